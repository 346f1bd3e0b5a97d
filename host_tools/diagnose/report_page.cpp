#include <string>

#include "diagnose/outputs.hpp"

namespace rim::diagnose {

std::string report_html(const Diagnosis &diagnosis, const Measured &) {
  std::string text;
  for (const char letter : diagnosis.sentence) {
    if (letter == '<')
      text += "&lt;";
    else if (letter == '&')
      text += "&amp;";
    else
      text += letter;
  }
  return "<!DOCTYPE html><meta charset=\"utf-8\"><title>rim diagnose</title><h1>" + text +
         "</h1>\n";
}

} // namespace rim::diagnose
