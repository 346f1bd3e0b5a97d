/* SPDX-License-Identifier: MIT */
/* bus.h - where a replay's alarms go beside the console. A port chooses a source that provides
 * this: replay/no_bus.c, or what its port.mk names in NAME_BUS_SRC. */
#ifndef BUS_H
#define BUS_H

#include "rim/alarm.h"

/* Called once before the first row. Returns NULL, or why the bus cannot be used. */
const char *bus_open(void);

/* Called with every record. */
void bus_alarm(const rim_alarm *alarm);

/* Called once after the last row: prints counts by the function given. */
void bus_report(void (*print_count)(const char *what, uint32_t value));

#endif
