// SPDX-License-Identifier: MIT
// What the Arduino sketch uses of the core, as the language reference documents it.
#pragma once
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
unsigned long millis();
struct SerialPort {
  void begin(unsigned long baud) { (void)baud; }
  size_t println(const char *text) { return (size_t)printf("%s\n", text); }
};
extern SerialPort Serial;
void setup();
void loop();
