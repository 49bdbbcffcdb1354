/* What this start of the board was: why it came, and a number that tells it from the one before. */
#ifndef BOOT_H
#define BOOT_H
#include <stdint.h>

void boot_count(void); /* once, before anything is asked: takes some milliseconds */
uint32_t boot_nonce(void);
uint8_t boot_cause(void); /* bits of enum reset: MCUSR's, which a bootloader may have cleared, and whether memory survived */

#endif
