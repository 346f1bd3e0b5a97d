// SPDX-License-Identifier: MIT
#include "report/svg.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "log/log.hpp"
#include "util/utf8.hpp"

namespace rim::diagnose::report {

namespace {

constexpr double kLetter = 6.7; // mean width of a tick's digit at 12 px
constexpr double kXRoom = 40.0; // below a panel: ticks and the axis' name
constexpr const char *kMinus = "\u2212", *kThin = "\u202f", *kReplacement = "\ufffd";

std::string superscript(int exponent) {
  static const char *const kDigit[] = {"\u2070", "\u00b9", "\u00b2", "\u00b3", "\u2074",
                                       "\u2075", "\u2076", "\u2077", "\u2078", "\u2079"};
  std::string text = exponent < 0 ? "\u207b" : "";
  for (const char digit : std::to_string(std::abs(exponent)))
    text += kDigit[digit - '0'];
  return text;
}

// Digits in groups of three from 10 000 on; the sign of print.
std::string dressed(const std::string &plain) {
  const bool negative = !plain.empty() && plain[0] == '-';
  const std::string digits = plain.substr(negative ? 1 : 0);
  const std::size_t point = std::min(digits.find('.'), digits.size());
  std::string text = negative ? kMinus : "";
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (point > 4 && i > 0 && i < point && (point - i) % 3 == 0)
      text += kThin;
    text += digits[i];
  }
  return text;
}

int exponent_of(double value) {
  return value == 0.0 ? 0 : static_cast<int>(std::floor(std::log10(std::fabs(value)) + 1e-9));
}

std::string with_decimals(double value, int decimals) {
  const std::string text = fmt::format("{:.{}f}", value, std::clamp(decimals, 0, 12));
  const bool zero = text.find_first_of("123456789") == std::string::npos;
  return dressed(zero && text[0] == '-' ? text.substr(1) : text);
}

} // namespace

std::string escape(std::string_view text) {
  std::string out;
  out.reserve(text.size() + 16);
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = utf8_length(text.substr(i));
    const char letter = text[i];
    if (length == 0)
      out += kReplacement;
    else if (length > 1)
      out += text.substr(i, length);
    else if (letter == '&')
      out += "&amp;";
    else if (letter == '<')
      out += "&lt;";
    else if (letter == '>')
      out += "&gt;";
    else if (letter == '"')
      out += "&quot;";
    else if (letter == '\'')
      out += "&#39;";
    else if ((letter >= 0x20 && letter != 0x7f) || letter == '\n' || letter == '\t')
      out += letter;
    i += std::max<std::size_t>(1, length);
  }
  return out;
}

std::string number_text(double value, int digits) {
  if (!std::isfinite(value))
    return "n/a";
  if (value == 0.0)
    return "0";
  const int exponent = exponent_of(value);
  if (exponent < -3 || exponent > 6) {
    const std::string mantissa = fmt::format("{:.{}e}", value, digits - 1);
    const std::size_t e = mantissa.find('e');
    return dressed(mantissa.substr(0, e)) + "\u00d710" +
           superscript(std::stoi(mantissa.substr(e + 1)));
  }
  return with_decimals(value, digits - 1 - exponent);
}

std::string short_text(double value, int digits) {
  std::string text = number_text(value, digits);
  const std::size_t point = text.find('.');
  if (point == std::string::npos)
    return text;
  std::size_t end = std::min(text.find("\u00d7"), text.size()); // the power of ten stays
  const std::string power = text.substr(end);
  while (end > point + 1 && text[end - 1] == '0')
    --end;
  return text.substr(0, end == point + 1 ? point : end) + power;
}

std::string count_text(std::size_t count) { return dressed(std::to_string(count)); }

std::string value_text(double value, double stderror, const std::string &unit) {
  const std::string suffix = unit.empty() ? "" : " " + unit;
  if (!(stderror > 0.0) || !std::isfinite(stderror) || !std::isfinite(value))
    return number_text(value, 4) + suffix;
  const int last = exponent_of(stderror) - 1; // place of the error's second digit
  const int first = std::max(exponent_of(value), exponent_of(stderror));
  if (first >= -3 && first <= 6)
    return with_decimals(value, -last) + " \u00b1 " + with_decimals(stderror, -last) + suffix;
  const double power = std::pow(10.0, first);
  return "(" + with_decimals(value / power, first - last) + " \u00b1 " +
         with_decimals(stderror / power, first - last) + ")\u00d710" + superscript(first) + suffix;
}

std::string axis_text(const std::string &name, const std::string &unit) {
  return plain_name(name) + (unit.empty() ? "" : " (" + unit + ")");
}

std::size_t letters(std::string_view text) {
  std::size_t count = 0;
  for (const char byte : text)
    count += (static_cast<unsigned char>(byte) & 0xc0u) != 0x80u;
  return count;
}

std::string fitted(const std::string &text, double width) {
  const auto most = static_cast<std::size_t>(std::max(8.0, width / 7.4));
  if (letters(text) <= most)
    return text;
  const auto is_inside = [&text](std::size_t i) { // of a code point
    return i < text.size() && (static_cast<unsigned char>(text[i]) & 0xc0u) == 0x80u;
  };
  std::size_t head = most / 2, tail = text.size() - (most - 1) / 2;
  while (is_inside(head))
    --head;
  while (is_inside(tail))
    ++tail;
  return text.substr(0, head) + "\u2026" + text.substr(std::min(tail, text.size()));
}

Range padded(double low, double high) {
  if (!std::isfinite(low) || !std::isfinite(high) || low > high)
    return {-1.0, 1.0};
  const double least = 1e-9 * std::max(std::fabs(low), std::fabs(high));
  if (high - low <= least) {
    const double room = low == 0.0 ? 1.0 : 0.1 * std::fabs(low);
    return {low - room, high + room};
  }
  const double room = 0.04 * (high - low);
  return {low - room, high + room};
}

double Scale::at(double value) const {
  double low = data.low, high = data.high;
  if (is_log) {
    low = std::log(low);
    high = std::log(high);
    value = std::log(std::max(value, 1e-300));
  }
  // Far outside is drawn far outside, but not at numbers that a browser cannot hold.
  const double share = std::clamp((value - low) / (high - low), -5.0, 6.0);
  return from + share * (to - from);
}

Ticks linear_ticks(const Range &range, int most) {
  Ticks ticks;
  const double width = range.high - range.low;
  if (!(width > 0.0) || !std::isfinite(width) || most < 2)
    return ticks;
  const double raw = width / most;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  double step = 10.0 * power;
  for (const double factor : {5.0, 2.0, 1.0}) {
    if (factor * power >= raw)
      step = factor * power;
  }
  const double greatest = std::max(std::fabs(range.low), std::fabs(range.high));
  const bool scientific = exponent_of(greatest) > 6 || exponent_of(greatest) < -3;
  const int decimals = std::max(0, -exponent_of(step));
  for (double i = std::ceil(range.low / step - 1e-9); i * step <= range.high + 1e-9 * step; ++i) {
    const double value = i == 0.0 ? 0.0 : i * step;
    ticks.at.push_back(value);
    const int digits = 1 + std::max(0, exponent_of(value) - exponent_of(step));
    ticks.text.push_back(scientific && value != 0.0 ? number_text(value, digits)
                                                    : with_decimals(value, decimals));
  }
  return ticks;
}

Ticks log_ticks(const Range &range) {
  Ticks ticks;
  const bool wide = range.high > 200.0 * range.low;
  for (int power = exponent_of(range.low) - 1; power <= exponent_of(range.high) + 1; ++power) {
    for (const double factor : {1.0, 2.0, 5.0}) {
      const double value = factor * std::pow(10.0, power);
      if (value < range.low * 0.999 || value > range.high * 1.001 || (wide && factor > 1.5))
        continue;
      ticks.at.push_back(value);
      ticks.text.push_back(with_decimals(value, std::max(0, -power)));
    }
  }
  return ticks;
}

namespace {

bool is_drawable(double x, double y) { return std::isfinite(x) && std::isfinite(y); }

// Path data in tenths of a pixel, each point relative to the last: half the bytes of absolute ones.
class Path {
public:
  void move(double x, double y) { point('m', x, y); }
  void line(double x, double y) { point('l', x, y); }
  void dot() {
    text_ += "h0";
    last_ = 'h';
  }
  void box(const Svg::Box &b) {
    point('m', b.x, b.y);
    const long w = std::max(1L, tenths(b.width)), h = std::max(1L, tenths(b.height));
    text_ += 'h' + number(w) + 'v' + number(h) + 'h' + number(-w) + 'z';
    last_ = 'z'; // back at the box's corner
  }
  void end() { text_ += 'z'; }
  const std::string &text() const { return text_; }

private:
  static long tenths(double v) { return std::lround(10.0 * v); }
  static std::string number(long t) {
    std::string out = t < 0 ? "-" : "";
    const long a = std::labs(t);
    if (a >= 10 || a == 0)
      out += std::to_string(a / 10);
    if (a % 10 != 0)
      out += "." + std::to_string(a % 10);
    return out;
  }
  void point(char command, double x, double y) {
    const long px = tenths(x), py = tenths(y);
    if (command != last_ || command == 'm') // a second pair after m would be a line
      text_ += command;
    else if (px - x_ >= 0)
      text_ += ' ';
    text_ += number(px - x_) + (py - y_ >= 0 ? " " : "") + number(py - y_);
    x_ = px;
    y_ = py;
    last_ = command;
  }
  std::string text_;
  long x_ = 0, y_ = 0;
  char last_ = 0;
};

} // namespace

Svg::Svg(double width, double height, const std::string &label)
    : width_(width), height_(height), label_(label) {}

void Svg::line(double x1, double y1, double x2, double y2, const char *style) {
  body_ += fmt::format("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" "
                       "class=\"{}\"/>\n",
                       x1, y1, x2, y2, style);
}

void Svg::path(const std::string &data, const std::string &style, const std::string &title) {
  if (data.empty())
    return;
  body_ += "<path d=\"" + data + "\" class=\"" + style + "\"";
  body_ += title.empty() ? "/>\n" : "><title>" + escape(title) + "</title></path>\n";
}

void Svg::polyline(const Points &points, const char *style) {
  Path data;
  bool is_first = true;
  for (const auto &[x, y] : points) {
    if (is_drawable(x, y) && is_first)
      data.move(x, y);
    else if (is_drawable(x, y))
      data.line(x, y);
    is_first = !is_drawable(x, y);
  }
  path(data.text(), style, "");
}

void Svg::polygon(const Points &points, const char *style) {
  Path data;
  for (const auto &[x, y] : points) {
    if (is_drawable(x, y) && data.text().empty())
      data.move(x, y);
    else if (is_drawable(x, y))
      data.line(x, y);
  }
  if (data.text().empty())
    return;
  data.end();
  path(data.text(), style, "");
}

void Svg::dots(const Points &points, const char *style) {
  Path data;
  for (const auto &[x, y] : points) {
    if (!is_drawable(x, y))
      continue;
    data.move(x, y);
    data.dot();
  }
  path(data.text(), std::string("dots ") + style, "");
}

void Svg::boxes(const std::vector<Box> &boxes, const std::string &style, const std::string &title) {
  Path data;
  for (const Box &b : boxes) {
    if (is_drawable(b.x, b.y) && is_drawable(b.width, b.height))
      data.box(b);
  }
  path(data.text(), style, title);
}

void Svg::rectangle(double x, double y, double width, double height, const std::string &style,
                    const std::string &title) {
  body_ += fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" "
                       "class=\"{}\"",
                       x, y, std::max(0.0, width), std::max(0.0, height), style);
  body_ += title.empty() ? "/>\n" : "><title>" + escape(title) + "</title></rect>\n";
}

void Svg::text(double x, double y, const char *style, const std::string &text) {
  body_ += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" class=\"{}\">{}</text>\n", x, y, style,
                       escape(text));
}

void Svg::text_upright(double x, double y, const char *style, const std::string &text) {
  body_ += fmt::format("<text transform=\"translate({:.1f} {:.1f}) rotate(-90)\" "
                       "class=\"{}\">{}</text>\n",
                       x, y, style, escape(text));
}

std::string Svg::markup() const {
  return fmt::format("<svg viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" height=\"{1:.0f}\" "
                     "role=\"img\" aria-label=\"{2}\">\n{3}</svg>\n",
                     width_, height_, escape(label_), body_);
}

namespace {

// At least three where that many have room.
Ticks y_ticks(const Range &y, double height) {
  int most = std::max(2, static_cast<int>(height / 34.0));
  Ticks ticks = linear_ticks(y, most);
  while (ticks.at.size() < 3 && most < static_cast<int>(height / 18.0))
    ticks = linear_ticks(y, ++most);
  return ticks;
}

} // namespace

double room_for_y(const Range &y, double height) {
  std::size_t longest = 1;
  const Ticks ticks = y_ticks(y, height - kXRoom);
  for (const std::string &text : ticks.text)
    longest = std::max(longest, letters(text));
  return 32.0 + kLetter * static_cast<double>(longest);
}

Panel draw_axes(Svg &svg, double left, double top, double width, double height, double room_left,
                const Axes &axes) {
  Panel p;
  p.left = left + room_left;
  p.top = top + 6.0;
  p.width = width - room_left - 14.0;
  p.height = height - 6.0 - (axes.x_ticks_named ? kXRoom : 8.0);
  p.x = {axes.x, 0.0, p.width, false};
  p.y = {axes.y, p.height, 0.0, false};
  const Ticks y = y_ticks(axes.y, p.height);
  for (std::size_t i = 0; i < y.at.size(); ++i) {
    const double at = p.top + p.y.at(y.at[i]);
    svg.line(p.left, at, p.left + p.width, at, "grid");
    svg.text(p.left - 7.0, at + 4.0, "tick end", y.text[i]);
  }
  // As many as their own texts leave room for.
  int most = std::max(2, static_cast<int>(p.width / 52.0));
  Ticks x = linear_ticks(axes.x, most);
  const auto crowded = [&x, &p] {
    double taken = 0.0;
    for (const std::string &text : x.text)
      taken += kLetter * static_cast<double>(letters(text)) + 16.0;
    return taken > p.width;
  };
  while (x.at.size() < 3 && most < 9)
    x = linear_ticks(axes.x, ++most);
  while (most > 2 && crowded())
    x = linear_ticks(axes.x, --most);
  for (std::size_t i = 0; i < x.at.size(); ++i) {
    const double at = p.left + p.x.at(x.at[i]);
    svg.line(at, p.top, at, p.top + p.height, "grid");
    if (axes.x_ticks_named)
      svg.text(at, p.top + p.height + 16.0, "tick middle", x.text[i]);
  }
  svg.line(p.left, p.top + p.height, p.left + p.width, p.top + p.height, "axis");
  svg.line(p.left, p.top, p.left, p.top + p.height, "axis");
  if (axes.x_ticks_named)
    svg.text(p.left + p.width / 2.0, p.top + p.height + 34.0, "label middle",
             fitted(axes.x_text, p.width));
  svg.text_upright(left + 12.0, p.top + p.height / 2.0, "label middle",
                   fitted(axes.y_text, height - 10.0));
  return p;
}

void open(Svg &svg, const Panel &p) {
  svg.raw(fmt::format("<svg x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\">\n",
                      p.left, p.top, p.width, p.height));
}

void close(Svg &svg) { svg.raw("</svg>\n"); }

} // namespace rim::diagnose::report
