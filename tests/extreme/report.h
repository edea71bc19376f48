#pragma once
// What the extreme suite prints and writes.
#include <string>
#include <vector>

#include "tests/extreme/runner.h"

namespace lightmill::test {

/// The head of the table, and a line of it, aligned; no line break at the end.
std::string text_head();
std::string text_row(const Row& row);
/// How many rows have each verdict: "210 pass, 3 noisy, 12 skip, 0 FAIL".
std::string text_summary(const std::vector<Row>& rows);
/// An array of objects with the table's columns.
std::string json_report(const std::vector<Row>& rows);
/// A page that needs nothing else: the table, sortable by its heads, and a picture per case, exposed so that
/// its answer is middle grey.
std::string html_report(const std::vector<Row>& rows);

}  // namespace lightmill::test
