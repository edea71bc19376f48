#pragma once
// Parts that the report of one run and the comparison of several share.
#include <string>

#include "common/error/error_curve.h"

namespace lightmill {

/// Makes the folder if absent. Throws Error(kFailed).
void make_report_folder(const std::string& folder);
/// The file is written beside and renamed, so a reader of a running job's report never sees half a file.
/// Throws Error(kFailed).
void write_report_file(const std::string& folder, const std::string& name, const std::string& content);
/// The content of error.csv.
std::string error_csv(const ErrorCurve& curve);
/// A cell of a CSV file, quoted where it must be.
std::string csv_cell(const std::string& text);
/// HTML from the doctype to the page's heading. `title` is plain text.
std::string html_head(const std::string& title);
/// Paragraphs: the slope of the error, whether it flattens, and what more time or more workers buy.
std::string curve_statements(const ErrorCurve& curve);

}  // namespace lightmill
