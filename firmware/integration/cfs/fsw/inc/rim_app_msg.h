/* SPDX-License-Identifier: MIT */
/* rim_app_msg.h - the messages of rim_app on the software bus. */
#ifndef RIM_APP_MSG_H
#define RIM_APP_MSG_H

#include "cfe.h"

#include "rim/monitor.h"
#include "rim_app_cfg.h"

/* Commands. */
#define RIM_APP_NOOP_CC 0
#define RIM_APP_RESET_COUNTERS_CC 1
#define RIM_APP_ACKNOWLEDGE_CC 2 /* somebody has seen the alarm */
#define RIM_APP_CLEAR_CC 3       /* the cause is gone: forget the alarm and its observations */

typedef struct {
  CFE_MSG_CommandHeader_t CommandHeader;
} RIM_APP_NoArgsCmd_t;

/* ACKNOWLEDGE and CLEAR name the newest record of the alarm that is meant. */
typedef struct {
  CFE_MSG_CommandHeader_t CommandHeader;
  uint32 Sequence;
  uint32 ModelId;
} RIM_APP_AlarmCmd_t;

/* One row of telemetry, from the application that knows the vehicle's packets: values in the order
 * and units that `rim show MODEL.rim` prints. Send Count values; the message has its full size. */
typedef struct {
  CFE_MSG_TelemetryHeader_t TelemetryHeader;
  double TimeS; /* must increase */
  uint32 Count;
  uint32 Spare;
  double Value[RIM_APP_MAX_VALUES];
} RIM_APP_Row_t;

/* Every record, as rim/alarm.h describes it. */
typedef struct {
  CFE_MSG_TelemetryHeader_t TelemetryHeader;
  rim_alarm Record;
} RIM_APP_AlarmTlm_t;

typedef struct {
  uint8 CommandCounter;
  uint8 CommandErrorCounter;
  uint8 Level; /* rim_level by the newest row; STALE before the first and without an image */
  uint8 ImageLoaded;
  int32 ImageStatus;    /* rim_status of the newest image that was validated */
  uint32 ImagesRefused; /* by the validation */
  uint32 ImagesOpened;
  uint32 ModelId;
  uint32 Rows;    /* offered to the monitor since its image was opened */
  uint32 Refused; /* of another length, or while there was no image */
  uint32 Records;
  uint64 Digest; /* of all verdicts since then: that of `rim replay` over the same rows */
  rim_row_health RowHealth;
} RIM_APP_HkTlm_Payload_t;

typedef struct {
  CFE_MSG_TelemetryHeader_t TelemetryHeader;
  RIM_APP_HkTlm_Payload_t Payload;
} RIM_APP_HkTlm_t;

/* Events. */
#define RIM_APP_STARTED_INF_EID 1
#define RIM_APP_NOOP_INF_EID 2
#define RIM_APP_RESET_INF_EID 3
#define RIM_APP_ALARM_ERR_EID 4   /* an alarm stands */
#define RIM_APP_ALARM_INF_EID 5   /* it no longer stands, or the level is OK or WARN again */
#define RIM_APP_STALE_ERR_EID 6   /* nothing is known about the vehicle */
#define RIM_APP_COMMAND_INF_EID 7 /* obeyed */
#define RIM_APP_COMMAND_ERR_EID 8 /* refused */
#define RIM_APP_IMAGE_INF_EID 9   /* opened */
#define RIM_APP_IMAGE_ERR_EID 10  /* refused */
#define RIM_APP_PIPE_ERR_EID 11

#endif
