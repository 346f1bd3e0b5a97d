/* SPDX-License-Identifier: MIT */
/* For a kernel that includes it and calls nothing of it. */
