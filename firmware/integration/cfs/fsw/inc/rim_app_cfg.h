/* SPDX-License-Identifier: MIT */
/* rim_app_cfg.h - what a mission sets. */
#ifndef RIM_APP_CFG_H
#define RIM_APP_CFG_H

#include "cfe_core_api_msgid_mapping.h"

/* Bytes of the table, and of the largest image. cFE's limit: CFE_PLATFORM_TBL_MAX_SNGL_TABLE_SIZE,
 * by default 16384; the table file ends in what the image leaves free. */
#ifndef RIM_APP_IMAGE_BYTES
#define RIM_APP_IMAGE_BYTES 16384u
#endif
#ifndef RIM_APP_MONITOR_BYTES
#define RIM_APP_MONITOR_BYTES 65536u /* `rim show` prints what an image needs */
#endif
#ifndef RIM_APP_MAX_VALUES
#define RIM_APP_MAX_VALUES 32u /* of a row */
#endif
#define RIM_APP_PIPE_DEPTH 16u
#define RIM_APP_IDLE_MS 100 /* without a message: how often the monitor looks whether it is STALE */
#define RIM_APP_TABLE_FILE "/cf/rim_image.tbl"

#define RIM_APP_CMD_MID CFE_PLATFORM_CMD_TOPICID_TO_MIDV(0xC8)
#define RIM_APP_SEND_HK_MID CFE_PLATFORM_CMD_TOPICID_TO_MIDV(0xC9)
#define RIM_APP_HK_TLM_MID CFE_PLATFORM_TLM_TOPICID_TO_MIDV(0xC8)
#define RIM_APP_ALARM_TLM_MID CFE_PLATFORM_TLM_TOPICID_TO_MIDV(0xC9)
#define RIM_APP_ROW_MID CFE_PLATFORM_TLM_TOPICID_TO_MIDV(0xCA)

#endif
