/* wristctl motor board: ATmega2560 at 16 MHz, four DM542 drives, one serial line.
 * Interrupts step the axes (axis.c), keep the millisecond and the safety (safety.c) and move bytes (uart.c);
 * this loop answers commands, works out rates and reads load cells. Nothing here waits and nothing is allocated. */
#include "axis.h"
#include "boot.h"
#include "commands.h"
#include "frame.h"
#include "load_cells.h"
#include "motion.h"
#include "pins.h"
#include "safety.h"
#include "uart.h"
#include <avr/interrupt.h>
#include <avr/sleep.h>

static void sleep_until_interrupt(void) {
  cli();
  if (!uart_has_byte()) {
    sleep_enable();
    sei(); /* takes effect after the next instruction: no byte slips in between */
    sleep_cpu();
    sleep_disable();
  }
  sei();
}

int main(void) {
  static struct frame frame;
  pins_init();
  boot_count();
  axes_init();
  uart_init();
  commands_init();
  safety_init();
  set_sleep_mode(SLEEP_MODE_IDLE);
  sei();
  for (;;) {
    safety_alive();
    if (frame_receive(&frame)) {
      commands_answer(&frame);
      frame_send(&frame);
    }
    motion_poll();
    load_cells_poll();
    sleep_until_interrupt();
  }
}
