/* SPDX-License-Identifier: MIT */
/* The recording, as the constant data of a program. RECORDING is the file's name. */
  .section .rodata
  .balign 8
  .globl recording, recording_end
recording:
  .incbin RECORDING
recording_end:
#if defined(__linux__) && defined(__ELF__)
  .section .note.GNU-stack, "", %progbits
#endif
