// SPDX-License-Identifier: MIT
#include "log/date_time.hpp"

#include <cstdint>

#include "log/csv_text.hpp"

namespace rim {

namespace {

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
  // Reads exactly `digits` digits, whose number lies within the bounds.
  bool number(std::size_t digits, int low, int high, int &value) {
    if (left_.size() < digits)
      return false;
    value = 0;
    for (std::size_t i = 0; i < digits; ++i) {
      if (left_[i] < '0' || left_[i] > '9')
        return false;
      value = 10 * value + (left_[i] - '0');
    }
    left_.remove_prefix(digits);
    return value >= low && value <= high;
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

bool take_date(Scanner &scan, std::int64_t &days) {
  int year = 0, month = 0, day = 0;
  Scanner dotted = scan;
  if (dotted.number(2, 1, 31, day) && dotted.take(".") && dotted.number(2, 1, 12, month) &&
      dotted.take(".") && dotted.number(4, 1, 9999, year)) {
    scan = dotted;
  } else if (!(scan.number(4, 1, 9999, year) && scan.take("-/") && scan.number(2, 1, 12, month) &&
               scan.take("-/") && scan.number(2, 1, 31, day))) {
    return false;
  }
  days = days_since_1970(year, month, day);
  return true;
}

bool take_time(Scanner &scan, double &seconds) {
  int hour = 0, minute = 0, second = 0;
  double part = 0.0;
  if (!(scan.number(2, 0, 24, hour) && scan.take(":") && scan.number(2, 0, 59, minute)))
    return false;
  if (scan.take(":") && !scan.number(2, 0, 60, second))
    return false;
  if (scan.take(".,") && !scan.fraction(part))
    return false;
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
  if ((!west && !scan.take("+")) || !scan.number(2, 0, 23, hours))
    return false;
  (void)scan.take(":");
  if (!scan.at_end() && !scan.number(2, 0, 59, minutes))
    return false;
  offset_s = (west ? -60.0 : 60.0) * (60.0 * hours + minutes);
  return true;
}

} // namespace

bool parse_date_time(std::string_view text, double &seconds) {
  text = trimmed(text);
  Scanner scan(text);
  std::int64_t days = 0;
  double of_day = 0.0, offset_s = 0.0;
  if (Scanner whole = scan; take_date(whole, days)) {
    if (!whole.take("T "))
      return false;
    scan = whole;
  }
  if (!take_time(scan, of_day) || !take_zone(scan, offset_s) || !scan.at_end())
    return false;
  seconds = 86400.0 * static_cast<double>(days) + of_day - offset_s;
  return true;
}

} // namespace rim
