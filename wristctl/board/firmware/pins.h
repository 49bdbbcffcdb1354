/* Which pin is what; the wiring table in docs/hardware/wiring.md says the same in terminals.
 *
 *   axis          0    1    2    3
 *   STEP (port A) PA0  PA2  PA4  PA6    Mega D22 D24 D26 D28   the drive steps on the rising edge
 *   DIR  (port A) PA1  PA3  PA5  PA7    Mega D23 D25 D27 D29   high = toward smaller positions
 *   ENA  (port C) PC0  PC1  PC2  PC3    Mega D37 D36 D35 D34   high = opto energised = drive OFF
 *
 *   ALM  (port L) PL0  PL1  PL2  PL3    Mega D49 D48 D47 D46   closed to GND while all is well, open in an alarm
 *
 *   load cells' HX711 (port F): PF0  PF2  PF4  PF6    Mega A0 A2 A4 A6   DOUT, low when it has something new
 *                               PF1  PF3  PF5  PF7    Mega A1 A3 A5 A7   PD_SCK
 *
 *   emergency stop input PG0 (D41), closed to GND while all is well: a broken wire stops too
 *   state lamp           PB7 (D13, the board's own)                                                */
#ifndef PINS_H
#define PINS_H
#include <avr/io.h>
#include <stdbool.h>

#define STEP_BIT(axis) (1 << (2 * (axis)))
#define DIR_BIT(axis) (2 << (2 * (axis)))
#define ENA_BITS 0x0F
#define ALARM_BITS 0x0F
#define LOAD_DATA_BIT(axis) (1 << (2 * (axis)))
#define LOAD_CLOCK_BIT(axis) (2 << (2 * (axis)))

static inline void pins_init(void) {
  PORTC |= ENA_BITS; /* before the direction, so that the drives never see an enabling level */
  DDRC |= ENA_BITS;
  PORTA = 0;
  DDRA = 0xFF;
  PORTG |= _BV(PG0); /* pull-up */
  PORTL |= ALARM_BITS; /* pull-ups */
  uint8_t no_jtag = MCUCR | _BV(JTD); /* PF4 to PF7 are JTAG's unless the fuses say otherwise, as on some clones */
  MCUCR = no_jtag; /* twice within four cycles */
  MCUCR = no_jtag;
  PORTF = 0x55;        /* pull-ups of DOUT: where there is no amplifier it reads high, nothing new */
  DDRF = 0xAA;
  DDRB |= _BV(PB7);
}

static inline void drives_on(void) { PORTC &= ~ENA_BITS; }
static inline void drives_off(void) { PORTC |= ENA_BITS; }
static inline bool drives_are_on(void) { return !(PORTC & ENA_BITS); }
static inline bool estop_open(void) { return PING & _BV(PG0); }
static inline bool alarm_open(void) { return PINL & ALARM_BITS; }

#endif
