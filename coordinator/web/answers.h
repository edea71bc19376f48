#pragma once
// How HTTP requests are answered: JSON, and errors as {"error": one line} with a status.
#include <httplib.h>

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace lightmill {

void answer(httplib::Response& response, const nlohmann::json& value, int status = 200);
void refuse(httplib::Response& response, int status, const std::string& why);
/// Runs a handler; what it throws becomes the answer.
void guarded_answer(httplib::Response& response, const std::function<void()>& handler);
/// A parameter that is a whole number from 0 to 10^15; `fallback` if it is absent. Throws Error(kUsage).
int64_t whole(const httplib::Request& request, const char* name, int64_t fallback);

}  // namespace lightmill
