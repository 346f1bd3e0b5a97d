/* SPDX-License-Identifier: MIT */
/* The flight image as a table; what follows the image is ignored. */
#include "cfe_tbl_filedef.h"

#include "rim_app_cfg.h"

unsigned char RimImage[RIM_APP_IMAGE_BYTES] = {
#include "rim_image_bytes.inc"
};

CFE_TBL_FILEDEF(RimImage, RIM_APP.Image, Flight image of rimwatch, rim_image.tbl)
