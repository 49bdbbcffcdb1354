/* What this start of the board was: why it came, and a number that tells it from the one before. */
#ifndef BOOT_H
#define BOOT_H
#include <stdint.h>

uint32_t boot_nonce(void);
uint8_t boot_cause(void); /* MCUSR's bits (a bootloader may have cleared them), and BOOT_WARM where memory survived */
#define BOOT_WARM 0x80

#endif
