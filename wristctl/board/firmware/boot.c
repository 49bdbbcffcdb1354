#include "boot.h"
#include "messages.h"
#include <avr/eeprom.h>
#include <avr/io.h>
#include <avr/wdt.h>

#define MAGIC 0x77726973UL

/* Not cleared at start: kept over a reset, random after power came on. */
static uint32_t magic __attribute__((section(".noinit")));
static uint8_t cause __attribute__((section(".noinit")));

/* Before main and before memory is set up: the watchdog may still be running from before the reset. */
void at_start(void) __attribute__((naked, used, section(".init3")));
void at_start(void) {
  cause = MCUSR;
  MCUSR = 0;
  wdt_disable();
  if (magic == MAGIC) cause |= RESET_WARM;
  magic = MAGIC;
}

/* Memory comes up much alike after each power-on, so starts are counted where nothing is lost. A cell bears 100,000. */
static uint32_t starts EEMEM;
static uint32_t nonce;

void boot_count(void) {
  nonce = eeprom_read_dword(&starts) + 1;
  eeprom_update_dword(&starts, nonce);
}

uint32_t boot_nonce(void) { return nonce; }
uint8_t boot_cause(void) { return cause; }
