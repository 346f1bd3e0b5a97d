// SPDX-License-Identifier: MIT
#include "log/date_time.hpp"

#include <cctype>
#include <cstdint>
#include <string>

#include "log/csv_text.hpp"

namespace rim {

namespace {

constexpr double kDay_s = 86400.0;

// Takes what it is asked for from the front, or nothing.
class Scanner {
public:
  explicit Scanner(std::string_view text) : left_(text) {}
  bool at_end() const { return left_.empty(); }
  bool take(std::string_view any_of) {
    if (left_.empty() || any_of.find(left_.front()) == std::string_view::npos)
      return false;
    left_.remove_prefix(1);
    return true;
  }
  // At least and at most so many digits, within the bounds.
  bool number(std::size_t least, std::size_t most, int low, int high, int &value) {
    std::size_t digits = 0;
    for (value = 0; digits < most && digits < left_.size(); ++digits) {
      if (left_[digits] < '0' || left_[digits] > '9')
        break;
      value = 10 * value + (left_[digits] - '0');
    }
    left_.remove_prefix(digits);
    return digits >= least && value >= low && value <= high;
  }
  // The first three letters of an English month, in either case: 1 to 12.
  bool month(int &value) {
    static constexpr std::string_view kMonths = "janfebmaraprmayjunjulaugsepoctnovdec";
    std::string word(left_.substr(0, 3));
    for (char &letter : word)
      letter = static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
    const std::size_t at = word.size() == 3 ? kMonths.find(word) : std::string_view::npos;
    if (at == std::string_view::npos || at % 3 != 0)
      return false;
    value = static_cast<int>(at / 3) + 1;
    left_.remove_prefix(3);
    return true;
  }
  bool fraction(double &value) {
    double unit = 1.0;
    std::size_t digits = 0;
    for (value = 0.0; !left_.empty() && left_.front() >= '0' && left_.front() <= '9'; ++digits) {
      unit /= 10.0;
      value += unit * (left_.front() - '0');
      left_.remove_prefix(1);
    }
    return digits > 0;
  }

private:
  std::string_view left_;
};

// Of the proleptic Gregorian calendar, from 1970-01-01 (H. Hinnant, chrono-compatible low-level
// date algorithms, days_from_civil).
std::int64_t days_since_1970(int year, int month, int day) {
  const int y = year - (month <= 2 ? 1 : 0);
  const int era = y / 400, of_era = y - era * 400;
  const int of_year = (153 * (month + (month > 2 ? -3 : 9)) + 2) / 5 + day - 1;
  return std::int64_t{era} * 146097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719468;
}

// Of two digits: the years from 1970 to 2069.
bool take_year(Scanner &scan, int &year) {
  Scanner whole = scan;
  if (whole.number(4, 4, 1, 9999, year)) {
    scan = whole;
    return true;
  }
  if (!scan.number(2, 2, 0, 99, year))
    return false;
  year += year < 70 ? 2000 : 1900;
  return true;
}

// 13.04.2025, 2025-04-13, 04/13/2025 or, day first, 13/04/2025, 13-Apr-2025.
bool take_date(Scanner &scan, bool day_first, std::int64_t &days) {
  int year = 0, month = 0, day = 0;
  const auto two = [](Scanner &s, int most, int &value) { return s.number(1, 2, 1, most, value); };
  Scanner dotted = scan, slashed = scan, named = scan;
  if (two(dotted, 31, day) && dotted.take(".") && two(dotted, 12, month) && dotted.take(".") &&
      take_year(dotted, year)) {
    scan = dotted;
  } else if (two(slashed, day_first ? 31 : 12, day_first ? day : month) && slashed.take("/") &&
             two(slashed, day_first ? 12 : 31, day_first ? month : day) && slashed.take("/") &&
             take_year(slashed, year)) {
    scan = slashed;
  } else if (two(named, 31, day) && named.take("- ") && named.month(month) && named.take("- ") &&
             take_year(named, year)) {
    scan = named;
  } else if (!(scan.number(4, 4, 1, 9999, year) && scan.take("-/") && two(scan, 12, month) &&
               scan.take("-/") && two(scan, 31, day))) {
    return false;
  }
  days = days_since_1970(year, month, day);
  return true;
}

bool take_time(Scanner &scan, double &seconds) {
  int hour = 0, minute = 0, second = 0;
  double part = 0.0;
  if (!(scan.number(1, 2, 0, 24, hour) && scan.take(":") && scan.number(2, 2, 0, 59, minute)))
    return false;
  if (scan.take(":") && !scan.number(2, 2, 0, 60, second))
    return false;
  if (scan.take(".,") && !scan.fraction(part))
    return false;
  Scanner half = scan;
  (void)half.take(" ");
  const bool afternoon = half.take("Pp");
  if ((afternoon || half.take("Aa")) && half.take("Mm")) {
    if (hour < 1 || hour > 12)
      return false;
    hour = hour % 12 + (afternoon ? 12 : 0);
    scan = half;
  }
  seconds = 3600.0 * hour + 60.0 * minute + second + part;
  return true;
}

// Z, +01:00, +0100 or nothing; what is to be subtracted.
bool take_zone(Scanner &scan, double &offset_s) {
  offset_s = 0.0;
  if (scan.at_end() || scan.take("Z"))
    return true;
  const bool west = scan.take("-");
  int hours = 0, minutes = 0;
  if ((!west && !scan.take("+")) || !scan.number(2, 2, 0, 23, hours))
    return false;
  (void)scan.take(":");
  if (!scan.at_end() && !scan.number(2, 2, 0, 59, minutes))
    return false;
  offset_s = (west ? -60.0 : 60.0) * (60.0 * hours + minutes);
  return true;
}

} // namespace

bool parse_date(std::string_view text, bool day_first) {
  Scanner scan(trimmed(text));
  std::int64_t days = 0;
  return take_date(scan, day_first, days) && scan.at_end();
}

bool parse_date_time(std::string_view text, DateReading &reading, double &seconds) {
  Scanner scan(trimmed(text));
  std::int64_t days = 0;
  double of_day = 0.0, offset_s = 0.0;
  Scanner whole = scan;
  const bool dated = take_date(whole, reading.day_first, days);
  if (dated) {
    if (!whole.take("T "))
      return false;
    scan = whole;
  }
  if (!take_time(scan, of_day) || !take_zone(scan, offset_s) || !scan.at_end())
    return false;
  seconds = kDay_s * static_cast<double>(days) + of_day - offset_s;
  if (!dated) {
    seconds += kDay_s * reading.midnights;
    if (seconds < reading.last_s - kDay_s / 2) { // NaN: the first
      seconds += kDay_s;
      reading.midnights++;
    }
    reading.last_s = seconds;
  }
  return true;
}

bool is_date(std::string_view text, bool day_first) {
  DateReading reading;
  reading.day_first = day_first;
  double ignored = 0.0;
  return parse_date(text, day_first) || parse_date_time(text, reading, ignored);
}

} // namespace rim
