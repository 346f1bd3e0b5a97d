// SPDX-License-Identifier: MIT
// report/svg.hpp - the report's drawing: escaped text, numbers for people, axes, shapes.
//
// Coordinates are CSS pixels of a picture's own width; colours are classes of report_style.cpp, so
// that a picture follows the page into the dark and onto paper.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace rim::diagnose::report {

// For element content and quoted attributes: & < > " ' escaped, control characters dropped, bytes
// that are no UTF-8 replaced by U+FFFD.
std::string escape(std::string_view text);

// "-1.93 x 10^-4" with the signs of print, "12 300", "0.25"; "n/a" when not finite. Plain text.
std::string number_text(double value, int digits = 3);
// Without the zeros that only say how exact it is: "300", "0.3".
std::string short_text(double value, int digits = 4);
std::string count_text(std::size_t count); // "12 300"
// "0.0123 +- 0.0004 1/m": the error with two digits, the value to the same place.
std::string value_text(double value, double stderror, const std::string &unit);
// "altitude (m)": the name in words with its unit.
std::string axis_text(const std::string &name, const std::string &unit);
// Code points, to tell how much room a text takes.
std::size_t letters(std::string_view text);

// The text, or its beginning and end with an ellipsis between, that fits in `width` pixels.
std::string fitted(const std::string &text, double width);

struct Range {
  double low = 0.0, high = 1.0;
};
// Least and greatest finite value with 4 % beside them; around a constant some room.
Range padded(double low, double high);

struct Scale {
  Range data;
  double from = 0.0, to = 1.0; // pixels
  bool is_log = false;
  double at(double value) const;
};

struct Ticks {
  std::vector<double> at;
  std::vector<std::string> text; // as many
};
// At 1, 2, 5 times a power of ten; at most `most`, at least two where the range has any width.
Ticks linear_ticks(const Range &range, int most);
Ticks log_ticks(const Range &range);

using Points = std::vector<std::pair<double, double>>; // pixels

class Svg {
public:
  // `label`: what the picture shows, for those who cannot see it.
  Svg(double width, double height, const std::string &label);
  void line(double x1, double y1, double x2, double y2, const char *style);
  // A point that is not finite parts a line and is left out of the others.
  void polyline(const Points &points, const char *style);
  void polygon(const Points &points, const char *style);
  void dots(const Points &points, const char *style); // one path; the stroke's width is the size
  void rectangle(double x, double y, double width, double height, const std::string &style,
                 const std::string &title = "");
  // Boxes as one path, with one title (may be empty).
  struct Box {
    double x, y, width, height;
  };
  void boxes(const std::vector<Box> &boxes, const std::string &style, const std::string &title);
  void text(double x, double y, const char *style, const std::string &text);
  void text_upright(double x, double y, const char *style, const std::string &text);
  void raw(const std::string &markup) { body_ += markup; }
  std::string markup() const;

private:
  void path(const std::string &data, const std::string &style, const std::string &title);
  double width_, height_;
  std::string label_, body_;
};

// The area of a graph in a picture, with its axes. Shapes drawn between open() and close() are
// clipped to it and count from its upper left corner.
struct Panel {
  double left = 0.0, top = 0.0, width = 0.0, height = 0.0;
  Scale x, y; // pixels from the panel's upper left corner
};

struct Axes {
  Range x, y;
  std::string x_text, y_text;
  bool x_ticks_named = true; // false: a panel above another that shares its axis
};

// Room for the y axis' labels (left) for these ranges; panels above one another share the widest.
double room_for_y(const Range &y, double height);
// Draws grid, ticks and labels in the box; the panel is what is left of it.
Panel draw_axes(Svg &svg, double left, double top, double width, double height, double room_left,
                const Axes &axes);
void open(Svg &svg, const Panel &panel);
void close(Svg &svg);

} // namespace rim::diagnose::report
