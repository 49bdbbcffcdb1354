#include "boot.h"
#include <avr/io.h>
#include <avr/wdt.h>

#define MAGIC 0x77726973UL

/* Not cleared at start: kept over a reset, random after power came on. */
static uint32_t magic __attribute__((section(".noinit")));
static uint32_t nonce __attribute__((section(".noinit")));
static uint8_t cause __attribute__((section(".noinit")));

/* Before main and before memory is set up: the watchdog may still be running from before the reset. */
void at_start(void) __attribute__((naked, used, section(".init3")));
void at_start(void) {
  cause = MCUSR;
  MCUSR = 0;
  wdt_disable();
  if (magic == MAGIC) cause |= BOOT_WARM;
  magic = MAGIC;
  nonce++;
}

uint32_t boot_nonce(void) { return nonce; }
uint8_t boot_cause(void) { return cause; }
