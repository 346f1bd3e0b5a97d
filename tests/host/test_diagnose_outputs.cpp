// SPDX-License-Identifier: MIT
// What rim diagnose leaves: the fields of diagnosis.json, a label for every row, a report that
// cannot be broken into, a folder that is whole or not there.
//
// test_diagnose_outputs --sample NAME DIR writes a sample's folder (falcon, robot, adequate,
// nasty), for tests/cli/report.sh and for looking at.
#include "check.hpp"
#include "report/data.hpp"
#include "report/output_folder.hpp"
#include "report/outputs.hpp"
#include "util/atomic_file.hpp"
#include "util/error.hpp"

#include "diagnose_case.hpp"
#include "diagnosis_sample.hpp"
#include "interrupted.hpp"

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sys/stat.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const DiagnosisSample &falcon() {
  static const DiagnosisSample sample = diagnosis_sample::falcon();
  return sample;
}
const DiagnosisSample &nasty() {
  static const DiagnosisSample sample = diagnosis_sample::nasty();
  return sample;
}

std::size_t count(const std::string &text, const std::string &part) {
  std::size_t n = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
    ++n;
  return n;
}

// A folder of its own that goes when the test ends.
struct Place {
  fs::path path;
  Place() {
    char name[] = "/tmp/rim_outputs_XXXXXX";
    assert_non_null(::mkdtemp(name));
    path = name;
  }
  ~Place() { fs::remove_all(path); }
  std::string operator/(const std::string &name) const { return (path / name).string(); }
  std::size_t entries() const {
    return static_cast<std::size_t>(
        std::distance(fs::directory_iterator(path), fs::directory_iterator()));
  }
};

void put(const std::string &path, const std::string &text) { std::ofstream(path) << text; }

const std::vector<std::pair<std::string, std::string>> &files() {
  static const std::vector<std::pair<std::string, std::string>> list = {
      {"diagnosis.json", "{\"schema\": \"rim-diagnosis/1\"}"},
      {"labels.csv", "log,row,t_s,finding\n"}};
  return list;
}

// The message of the refusal; empty: it was done.
std::string refusal(const std::string &folder) {
  try {
    rim::diagnose::write_output_folder(files(), folder);
  } catch (const rim::DataError &error) {
    return error.what();
  }
  return "";
}

void has_keys(const Json &object, const std::vector<std::string> &keys) {
  for (const std::string &key : keys) {
    if (!object.contains(key))
      print_message("'%s' is missing in %s\n", key.c_str(), object.dump().substr(0, 400).c_str());
    assert_true(object.contains(key));
  }
}

void json_has_the_contract(void **) {
  const Json j = Json::parse(rim::diagnose::diagnosis_json(falcon().diagnosis, falcon().measured));
  has_keys(j, {"schema", "verdict", "findings", "gain", "notes", "seed", "version", "command"});
  assert_string_equal(j["schema"].get<std::string>().c_str(), "rim-diagnosis/1");
  assert_string_equal(j["verdict"].get<std::string>().c_str(), "inadequate");
  assert_int_equal(j["findings"].size(), 2);
  for (const Json &f : j["findings"]) {
    has_keys(f, {"channel", "cause", "sentence", "expression", "parameters", "region",
                 "inside_fraction", "ln_anom", "p_value", "alternatives", "separable"});
    has_keys(f["region"], {"features", "center", "inverse_shape", "bounds"});
    for (const Json &p : f["parameters"])
      has_keys(p, {"value", "stderr", "unit"});
    for (const Json &a : f["alternatives"])
      has_keys(a, {"cause", "delta_bic", "heldout_r2"});
  }
  const Json &drag = j["findings"][0], &bias = j["findings"][1];
  assert_true(drag["parameters"]["size"]["value"] == 1.9e-4);
  assert_true(drag["parameters"]["scale_height"]["unit"] == "m");
  assert_true(drag["region"]["bounds"] == Json::parse("[[0.0, 42000.0]]"));
  assert_true(bias["region"]["inverse_shape"].size() == 2);
  assert_true(bias["region"]["inverse_shape"][1][1] == 1.0 / 8100.0);
  assert_false(bias["separable"].get<bool>());
  assert_true(drag["separable"].get<bool>());
  // The one-step gain over all rows is the channel's; the horizon's stands in the table alone.
  const Json &gain = j["gain"]["channels"]["speed_mps"];
  has_keys(gain, {"rmse_before", "rmse_after", "nll_before", "nll_after", "ratio", "ratio_ci95"});
  assert_true(gain["ratio"] == 0.134);
  assert_int_equal(gain["ratio_ci95"].size(), 2);
  assert_int_equal(j["gain"]["table"].size(), 4);
}

void json_of_nothing_found(void **) {
  const DiagnosisSample s = diagnosis_sample::adequate();
  const Json j = Json::parse(rim::diagnose::diagnosis_json(s.diagnosis, s.measured));
  assert_true(j["verdict"] == "adequate");
  assert_true(j["findings"].is_array() && j["findings"].empty());
  assert_int_equal(j["gain"]["channels"].size(), 2);
}

void json_of_a_term_everywhere(void **) {
  DiagnosisSample s = diagnosis_sample::robot();
  const Json region =
      Json::parse(rim::diagnose::diagnosis_json(s.diagnosis, s.measured))["findings"][1]["region"];
  for (const char *key : {"features", "center", "inverse_shape", "bounds"})
    assert_true(region[key].is_array() && region[key].empty());
}

void json_has_no_nan(void **) {
  const std::string text = rim::diagnose::diagnosis_json(nasty().diagnosis, nasty().measured);
  const Json j = Json::parse(text); // strict: NaN and bad UTF-8 are errors
  assert_true(j["findings"][0]["p_value"].is_null());
  assert_true(j["findings"][0]["ln_anom"].is_null());
  assert_true(j["gain"]["channels"]["speed_mps"]["ratio_ci95"][1].is_null());
}

void labels_have_every_row(void **) {
  const std::string text = rim::diagnose::labels_csv(falcon().diagnosis, falcon().measured);
  std::size_t rows = 0;
  for (const rim::diagnose::LogSpan &log : falcon().measured.logs)
    rows += log.rows_in_file;
  assert_int_equal(count(text, "\n"), rows + 1);
  assert_int_equal(text.rfind("log,row,t_s,finding\n", 0), 0);
  // Rows that the table has not are there, as 0.
  assert_int_equal(count(text, "\nfalcon9/flight8.csv,387,,0\n"), 1);
  std::size_t acting[3] = {0, 0, 0};
  for (std::size_t i = 0; i < falcon().measured.rows(); ++i) {
    const bool drags = falcon().diagnosis.findings[0].acts[i] != 0;
    ++acting[drags ? 1 : (falcon().diagnosis.findings[1].acts[i] != 0 ? 2 : 0)];
  }
  assert_true(acting[1] > 0);
  assert_int_equal(count(text, ",1\n"), acting[1]);
  assert_int_equal(count(text, ",2\n"), acting[2]);
}

// A command of a moment ago and a lagged one keep their words and their unit; a feature that the
// logs do not have is said to be missing.
void features_of_another_moment_keep_their_unit(void **) {
  using namespace rim::diagnose::report;
  rim::diagnose::Measured t =
      diagnose_case::table(1, 20, 0.1, {{"u.cmd_v_mps", "m/s", true, false}});
  for (Eigen::Index i = 0; i < 20; ++i)
    t.x(i, 0) = static_cast<double>(i);
  const rim::diagnose::Diagnosis diagnosis;
  const View view = view_of(diagnosis, t, t.channels[0]);
  assert_string_equal(quantity_of("u.cmd_v_mps@0.2", view).text.c_str(), "cmd v 0.2 s ago (m/s)");
  assert_string_equal(quantity_of("u.cmd_v_mps~0.2", view).text.c_str(),
                      "cmd v lagged by 0.2 s (m/s)");
  assert_string_equal(quantity_of("u.cmd_v_mps@0.2~0.1", view).text.c_str(),
                      "cmd v 0.2 s ago lagged by 0.1 s (m/s)");
  assert_non_null(std::strstr(quantity_of("s.height_m", view).text.c_str(), "not in these logs"));
  rim::diagnose::Finding lost;
  lost.term.channel = t.channels[0].name;
  lost.term.form = "form";
  lost.term.basis = {"h"};
  lost.term.arguments = {{"h", "s.height_m"}};
  assert_string_not_equal(effect_problem(lost, view).c_str(), "");
}

void labels_quote_a_path(void **) {
  const std::string text = rim::diagnose::labels_csv(nasty().diagnosis, nasty().measured);
  assert_true(text.find("\n\"a,\"\"b\"\"\xff") != std::string::npos);
}

void report_escapes(void **) {
  const std::string page = rim::diagnose::report_html(nasty().diagnosis, nasty().measured);
  assert_int_equal(count(page, "<script>alert"), 0);
  assert_int_equal(count(page, "<img"), 0);
  assert_int_equal(count(page, "\xff"), 0);
  assert_int_equal(count(page, "\x01"), 0);
  assert_true(count(page, "&lt;script&gt;alert(3)") >= 1);
}

void report_is_self_contained(void **) {
  for (const DiagnosisSample &s :
       {falcon(), diagnosis_sample::robot(), nasty(), diagnosis_sample::adequate()}) {
    // The library's own text names places; what the page asks for is tested in a browser.
    setenv("RIM_DYGRAPHS", "/nowhere", 1);
    const std::string page = rim::diagnose::report_html(s.diagnosis, s.measured);
    unsetenv("RIM_DYGRAPHS");
    assert_int_equal(count(page, "<script"), 0);
    assert_int_equal(count(rim::diagnose::report_html(s.diagnosis, s.measured), " src=\""), 0);
    for (const char *part :
         {"http:", "https:", "//fonts", "@import", "url(", " src=\"", "stylesheet"})
      assert_int_equal(count(page, part), 0);
    assert_true(page.size() < 2'000'000);
    for (const char *part : {">nan", ">inf", "\"nan", "\"inf", "Mnan", "Lnan", " nan ", "-nan"}) {
      if (count(page, part) > 0)
        print_message("%s: %s\n", part, page.substr(page.find(part), 80).c_str());
      assert_int_equal(count(page, part), 0);
    }
  }
}

void report_says_it(void **) {
  const std::string page = rim::diagnose::report_html(falcon().diagnosis, falcon().measured);
  const std::size_t sentence = page.find("The simulation falls too fast");
  const std::size_t finding = page.find("id=\"finding-1\""), second = page.find("id=\"finding-2\"");
  const std::size_t gain = page.find("id=\"gain\""), again = page.find("id=\"again\"");
  assert_true(sentence != std::string::npos && again != std::string::npos);
  assert_true(sentence < finding && finding < second && second < gain && gain < again);
  assert_true(page.find("cannot tell") != std::string::npos);
  assert_true(page.find("worse") != std::string::npos);
}

void folder_appears_whole(void **) {
  const Place place;
  rim::diagnose::write_outputs(falcon().diagnosis, falcon().measured, place / "a/b/");
  for (const std::string &name : rim::diagnose::kOutputNames)
    assert_true(fs::file_size(place / ("a/b/" + name)) > 0);
  assert_int_equal(place.entries(), 1);
  fs::create_directory(place / "empty");
  assert_string_equal(refusal(place / "empty").c_str(), "");
  assert_true(fs::exists(place / "empty/labels.csv"));
}

void earlier_diagnosis_is_replaced(void **) {
  const Place place;
  rim::diagnose::write_outputs(falcon().diagnosis, falcon().measured, place / "out");
  ::chmod((place / "out").c_str(), 0750);
  assert_string_equal(refusal(place / "out").c_str(), "");
  assert_string_equal(rim::read_file(place / "out/labels.csv").c_str(), files()[1].second.c_str());
  assert_false(fs::exists(place / "out/report.html")); // of the earlier one
  assert_int_equal(place.entries(), 1);
  struct stat info {};
  assert_int_equal(::stat((place / "out").c_str(), &info), 0);
  assert_int_equal(info.st_mode & 07777, 0750);
}

void foreign_folder_is_refused(void **) {
  const Place place;
  const auto refused = [&place](const std::string &name, const std::string &reason) {
    const std::size_t before = place.entries();
    const std::string message = refusal(place / name);
    if (message.find(reason) == std::string::npos)
      print_message("'%s' not in '%s'\n", reason.c_str(), message.c_str());
    assert_true(message.find(reason) != std::string::npos);
    assert_true(message.find(place / name) != std::string::npos);
    assert_int_equal(place.entries(), before);
  };
  fs::create_directory(place / "thesis");
  put(place / "thesis/chapter1.tex", "years of work");
  refused("thesis", "chapter1.tex");
  assert_string_equal(rim::read_file(place / "thesis/chapter1.tex").c_str(), "years of work");
  fs::create_directory(place / "mixed");
  for (const auto &[name, content] : files())
    put(place / ("mixed/" + name), content);
  put(place / "mixed/notes.txt", "mine");
  refused("mixed", "notes.txt");
  fs::create_directory(place / "other");
  put(place / "other/report.html", "another program's");
  refused("other", "no diagnosis.json");
  fs::create_directories(place / "nested/report.html");
  refused("nested", "report.html");
  put(place / "file", "a file");
  refused("file", "is a file");
  assert_true(refusal(place / "file/below").find(place / "file") == 0);
}

// The old diagnosis stays, bit for bit, when the new one cannot be finished.
void failure_leaves_the_old(void **) {
  const Place place;
  assert_string_equal(refusal(place / "out").c_str(), "");
  const std::string earlier = rim::read_file(place / "out/diagnosis.json");
  try {
    rim::diagnose::write_output_folder({{"diagnosis.json", "new"}, {"no/such/folder", "x"}},
                                       place / "out");
    fail_msg("nothing was thrown");
  } catch (const rim::DataError &) {
  }
  assert_string_equal(rim::read_file(place / "out/diagnosis.json").c_str(), earlier.c_str());
  assert_int_equal(place.entries(), 1);
  if (::geteuid() == 0)
    return; // root may write anywhere
  ::chmod(place.path.c_str(), 0555);
  assert_true(!refusal(place / "out").empty());
  ::chmod(place.path.c_str(), 0755);
  assert_string_equal(rim::read_file(place / "out/diagnosis.json").c_str(), earlier.c_str());
}

// The files have their own names by the time that an interruption speaks of them.
void an_interruption_names_the_folder_in_place(void **) {
  const Place place;
  const std::string text = interrupted(
      [&place] {
        const rim::HoldInterrupts until_it_is_there;
        rim::diagnose::write_output_folder(files(), place / "out");
        raise(SIGINT);
      },
      [](pid_t) {});
  const std::string named =
      " files are complete and kept, the last " + fs::canonical(place / "out/labels.csv").string();
  if (text.find(named + "\n") == std::string::npos) // those of the tests before count too
    fail_msg("it says: %s", text.c_str());
}

void current_folder_is_refused(void **) {
  const Place place;
  const fs::path before = fs::current_path();
  fs::current_path(place.path);
  const std::string message = refusal("."), below = refusal("out"), deeper = refusal("a/b");
  fs::current_path(before);
  assert_true(message.find("current folder") != std::string::npos);
  assert_string_equal((below + deeper).c_str(), "");
  assert_true(fs::exists(place / "out/labels.csv") && fs::exists(place / "a/b/labels.csv"));
}

void a_link_stays_a_link(void **) {
  const Place place;
  fs::create_directory(place / "real");
  fs::create_directory_symlink(place / "real", place / "link");
  assert_string_equal(refusal(place / "link").c_str(), "");
  assert_true(fs::is_symlink(place / "link"));
  assert_true(fs::exists(place / "real/labels.csv"));
}

int write_sample(const std::string &name, const std::string &folder) {
  const DiagnosisSample s = name == "falcon"     ? diagnosis_sample::falcon()
                            : name == "robot"    ? diagnosis_sample::robot()
                            : name == "adequate" ? diagnosis_sample::adequate()
                                                 : diagnosis_sample::nasty();
  rim::diagnose::write_outputs(s.diagnosis, s.measured, folder);
  return 0;
}

} // namespace

int main(int argc, char **argv) {
  if (argc == 4 && std::string(argv[1]) == "--sample")
    return write_sample(argv[2], argv[3]);
  const CMUnitTest tests[] = {
      cmocka_unit_test(json_has_the_contract),
      cmocka_unit_test(json_of_nothing_found),
      cmocka_unit_test(json_of_a_term_everywhere),
      cmocka_unit_test(json_has_no_nan),
      cmocka_unit_test(labels_have_every_row),
      cmocka_unit_test(labels_quote_a_path),
      cmocka_unit_test(features_of_another_moment_keep_their_unit),
      cmocka_unit_test(report_escapes),
      cmocka_unit_test(report_is_self_contained),
      cmocka_unit_test(report_says_it),
      cmocka_unit_test(folder_appears_whole),
      cmocka_unit_test(earlier_diagnosis_is_replaced),
      cmocka_unit_test(foreign_folder_is_refused),
      cmocka_unit_test(failure_leaves_the_old),
      cmocka_unit_test(an_interruption_names_the_folder_in_place),
      cmocka_unit_test(current_folder_is_refused),
      cmocka_unit_test(a_link_stays_a_link),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
