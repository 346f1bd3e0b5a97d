# Programs for the target. They depend on librim.a and their transports alone.

.PHONY: firmware
firmware: lib
