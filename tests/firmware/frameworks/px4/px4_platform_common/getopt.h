// SPDX-License-Identifier: MIT
// PX4's options.
#pragma once
int px4_getopt(int argc, char *argv[], const char *options, int *myoptind, const char **myoptarg);
