#include "common/error/report/report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "common/base/error.h"
#include "common/error/report/report_text.h"
#include "tests/common/image/temp_folder.h"

namespace lightmill {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using testing::TempFolder;

std::string slurp(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

ErrorCurve example_curve() {
  ErrorCurve curve;
  curve.job_name = "a <job> & more";
  curve.points.push_back({0.5, 1, 16, {}, {}, {}, 1, {}, {}, {}});
  for (int i = 1; i < 8; ++i) {
    const double t = 0.5 * (1 << i);
    curve.points.push_back({t, 2 * t, 32 * t, 0.1 / t, i == 1 ? 0 : 0.08 / t, i == 1 ? 5 : 0.12 / t, 2 + i,
                            0.11 / t, 0.1 / t, 0.2});
  }
  curve.points.back().boxes = {BoxError{0.01, 0.005, 0.02, 0.03}, BoxError{0.004, {}, {}, {}}, BoxError{}};
  return curve;
}

/// Every opened tag is closed, in order; enough to know that nothing unescaped slipped in.
void expect_balanced_xml(const std::string& xml) {
  std::vector<std::string> open;
  for (size_t at = 0; (at = xml.find('<', at)) != std::string::npos; ++at) {
    const size_t end = xml.find('>', at);
    ASSERT_NE(end, std::string::npos);
    const std::string tag = xml.substr(at + 1, end - at - 1);
    if (tag.back() == '/') continue;
    if (tag[0] == '/') {
      ASSERT_FALSE(open.empty());
      EXPECT_EQ(open.back(), tag.substr(1));
      open.pop_back();
    } else {
      open.push_back(tag.substr(0, tag.find_first_of(" \n")));
    }
  }
  EXPECT_TRUE(open.empty());
}

TEST(Report, WritesThreeFilesThatStandAlone) {
  const TempFolder folder;
  Image image(8, 4);
  image.data[5] = 0.5f;
  ReportInfo info;
  info.title = "Title <&>";
  info.settings_json = R"({"spp":64,"grid":{"width":8},"name":"<b>"})";
  info.counters.shadow_rays = 12345;
  info.missing_light = {"about <a tenth>"};
  info.dropped[0] = {4, 1e-5};
  info.dropped[3] = {5, 0.25};
  const std::string out = folder / "new/report";
  write_report(out, info, example_curve(), image);
  const std::string html = slurp(out + "/report.html"), svg = slurp(out + "/error.svg");
  EXPECT_THAT(html, HasSubstr("data:image/png;base64,iVBORw0KGgo"));
  EXPECT_THAT(html, HasSubstr("<svg"));
  EXPECT_THAT(html, HasSubstr("Title &lt;&amp;&gt;"));
  EXPECT_THAT(html, HasSubstr("&lt;b&gt;"));
  EXPECT_THAT(html, HasSubstr("12345"));
  EXPECT_THAT(html, HasSubstr("Missing light:</strong> about &lt;a tenth&gt;."));
  EXPECT_THAT(html, HasSubstr("<td>4 contributions were not finite and were dropped, in at most 0.001 %"));
  EXPECT_THAT(html, HasSubstr("Dropped light:</strong> 5 samples were brighter than"));
  EXPECT_THAT(html, HasSubstr("Another minute"));
  EXPECT_THAT(html, HasSubstr("1/N law"));
  // The pixels' estimate is 0.1 / 64, and their true error 0.11 / 64.
  EXPECT_THAT(html, HasSubstr("<h2>Error at several scales</h2>"));
  EXPECT_THAT(html, HasSubstr("<td>4 × 4 pixels</td><td>0.01 (95 %: 0.005 to 0.02)</td><td>6.4</td>"
                              "<td>0.03</td><td>17.5</td>"));
  EXPECT_THAT(html, HasSubstr("<td>16 × 16 pixels</td><td>0.004</td><td>2.56</td><td></td><td></td>"));
  EXPECT_THAT(html, Not(HasSubstr("32 × 32")));
  EXPECT_THAT(html, Not(HasSubstr("<script")));
  EXPECT_THAT(html, Not(HasSubstr("src=\"http")));
  EXPECT_THAT(html, Not(HasSubstr("href=")));
  EXPECT_THAT(svg, HasSubstr("prefers-color-scheme"));
  EXPECT_THAT(svg, HasSubstr("1/time"));
  expect_balanced_xml(svg);
}

TEST(Report, CsvRoundTrips) {
  const TempFolder folder;
  ErrorCurve curve = example_curve();
  curve.points.at(1).denoised_relmse = 0.125;
  curve.points.at(1).denoised_relmse_low = 0.0625;
  curve.points.at(1).denoised_relmse_high = 0.25;
  write_report(folder.path().string(), {}, curve, Image(1, 1));
  EXPECT_THAT(slurp(folder / "report.html"), HasSubstr("0.125 (95 %: 0.0625 to 0.25)"));
  EXPECT_THAT(slurp(folder / "error.svg"), HasSubstr("denoised, 95 % interval"));
  const std::string csv = slurp(folder / "error.csv");
  EXPECT_EQ(
      csv.substr(0, csv.find('\n')),
      "wall_s,cpu_s,spp,relmse,relmse_low,relmse_high,batches,true_relmse,true_relmse_trimmed,true_flip,"
      "relmse_4,relmse_4_low,relmse_4_high,relmse_16,relmse_16_low,relmse_16_high,"
      "relmse_32,relmse_32_low,relmse_32_high,true_relmse_4,true_relmse_16,true_relmse_32,"
      "denoised_relmse,denoised_relmse_low,denoised_relmse_high");
  EXPECT_THAT(csv, HasSubstr("\n0.5,1,16,,,,1,,,,,,,,,,,,,,,,,,\n"));
  EXPECT_THAT(csv, HasSubstr(",0.125,0.0625,0.25\n"));
  EXPECT_THAT(csv, HasSubstr(",0.2,0.01,0.005,0.02,0.004,,,,,,0.03,,,,,\n"));
  const ErrorCurve back = read_report_csv(folder / "error.csv");
  ASSERT_EQ(back.points.size(), curve.points.size());
  ErrorCurve nameless = curve;
  nameless.job_name.clear();
  EXPECT_EQ(curve_to_json(back), curve_to_json(nameless));
}

TEST(Report, CsvOfOlderVersionsIsRead) {
  const TempFolder folder;
  std::ofstream(folder / "error.csv")
      << "wall_s,cpu_s,spp,relmse,relmse_low,relmse_high,batches,true_relmse,true_relmse_trimmed,true_flip\n"
         "1,2,32,0.5,,,2,,,0.25\n";
  const ErrorCurve curve = read_report_csv(folder / "error.csv");
  ASSERT_EQ(curve.points.size(), 1u);
  EXPECT_EQ(curve.points[0].relmse, 0.5);
  EXPECT_EQ(curve.points[0].true_flip, 0.25);
  EXPECT_EQ(curve.points[0].boxes, BoxErrors());
}

TEST(Report, WithoutFiguresOfBoxesThereIsNoTableOfScales) {
  const TempFolder folder;
  ErrorCurve curve = example_curve();
  curve.points.back().boxes = {};
  write_report(folder.path().string(), {}, curve, Image(1, 1));
  EXPECT_THAT(slurp(folder / "report.html"), Not(HasSubstr("several scales")));
}

TEST(Report, MalformedCsvNamesItsLine) {
  const TempFolder folder;
  const std::string header =
      "wall_s,cpu_s,spp,relmse,relmse_low,relmse_high,batches,true_relmse,true_relmse_trimmed,true_flip\n";
  const auto message = [&](const std::string& text) {
    std::ofstream(folder / "error.csv") << text;
    try {
      read_report_csv(folder / "error.csv");
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  EXPECT_EQ(message(header), "");
  EXPECT_EQ(message(header + "1,1,1,,,,0,,,\r\n"), "");
  EXPECT_THAT(message("a,b\n"), HasSubstr("error.csv:1: "));
  EXPECT_THAT(message(header + "1,1,1,,,,0,,,\n1,2\n"), HasSubstr("error.csv:3: "));
  EXPECT_THAT(message(header + "1,1,x,,,,0,,,\n"), HasSubstr("error.csv:2: \"x\""));
  EXPECT_THAT(message(header + "1,1,nan,,,,0,,,\n"), HasSubstr("not a number"));
  EXPECT_THAT(message(header + ",1,1,,,,0,,,\n"), HasSubstr("must not be empty"));
  EXPECT_THAT(message(header + "1,1,1,,,,1.5,,,\n"), HasSubstr("count"));
  EXPECT_THAT(message(header + "1,1,1,,,,1,,,,\n"), HasSubstr("more than 10"));
  const std::string longer =
      header.substr(0, header.size() - 1) +
      ",relmse_4,relmse_4_low,relmse_4_high,relmse_16,relmse_16_low,relmse_16_high,relmse_32,relmse_32_low,"
      "relmse_32_high,true_relmse_4,true_relmse_16,true_relmse_32\n";
  EXPECT_EQ(message(longer + "1,1,1,,,,0,,,,,,,,,,,,,,,1\n"), "");
  EXPECT_THAT(message(longer + "1,1,1,,,,0,,,\n"), HasSubstr("expected 22 cells, found 10"));
  EXPECT_THAT(message(longer + "1,1,1,,,,0,,,,,,,,,,,,,,,,\n"), HasSubstr("more than 22"));
  EXPECT_THAT(message(longer + "1,1,1,,,,0,,,,y,,,,,,,,,,,\n"), HasSubstr("error.csv:2: \"y\""));
  const std::string longest =
      longer.substr(0, longer.size() - 1) + ",denoised_relmse,denoised_relmse_low,denoised_relmse_high\n";
  EXPECT_EQ(message(longest + "1,1,1,,,,0,,,,,,,,,,,,,,,1,,,2\n"), "");
  EXPECT_THAT(message(longest + "1,1,1,,,,0,,,,,,,,,,,,,,,1\n"), HasSubstr("expected 25 cells, found 22"));
  EXPECT_THROW(read_report_csv(folder / "none.csv"), Error);
}

TEST(Report, APointThatCameAgainStandsWhereItWas) {
  ErrorPoint first, second, again;
  first.spp = again.spp = 32, second.spp = 64;
  again.denoised_relmse = 0.01;
  const std::vector<ErrorPoint> points = newest_points({first, second, again});
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(points[0].denoised_relmse, 0.01);
  EXPECT_EQ(points[1].spp, 64);
}

TEST(Report, PlotsOfAnyCurveAreWellFormed) {
  ErrorCurve empty;
  expect_balanced_xml(error_svg({empty}));
  EXPECT_THAT(error_svg({empty}), HasSubstr("No estimate yet"));
  ErrorCurve one;
  one.points.push_back({3, 6, 32, 1e-3, 0, 1e3, 2, {}, {}, {}});
  expect_balanced_xml(error_svg({one}));
  ErrorCurve odd = example_curve();
  odd.points.push_back({0, 0, 0, 0.0, 0.0, 0.0, 2, {}, {}, {}});
  odd.points.push_back({1e9, 0, 0, 1e-30, {}, 1.0, 2, {}, {}, {}});
  odd.points.push_back({2e9, 0, 0, {}, 1.0, 2.0, 2, 1e-5, {}, {}});
  const std::string svg = error_svg({odd});
  expect_balanced_xml(svg);
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  EXPECT_THAT(svg, Not(HasSubstr("inf")));
}

TEST(Report, FoldersThatCanNotBeMadeAreErrors) {
  const TempFolder folder;
  std::ofstream(folder / "file") << "x";
  EXPECT_THROW(write_report(folder / "file", {}, {}, Image(1, 1)), Error);
  EXPECT_THROW(write_report(folder / "file/sub", {}, {}, Image(1, 1)), Error);
}

TEST(ReportText, Base64AndNumbers) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("M"), "TQ==");
  EXPECT_EQ(base64("Ma"), "TWE=");
  EXPECT_EQ(base64("Man"), "TWFu");
  EXPECT_EQ(base64("Many"), "TWFueQ==");
  EXPECT_EQ(exact_number(0.1), "0.1");
  EXPECT_EQ(short_number(0.00123456), "0.00123");
  EXPECT_EQ(short_duration(12.345), "12.3 s");
  EXPECT_EQ(short_duration(245), "4 min 05 s");
  EXPECT_EQ(short_duration(7800), "2 h 10 min");
  EXPECT_EQ(escape_markup("a<b>&\"'\x01"), "a&lt;b&gt;&amp;&quot;&#39;");
}

}  // namespace
}  // namespace lightmill
