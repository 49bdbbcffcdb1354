#include "uart.h"
#include "axis.h"
#include "messages.h"
#include "safety.h"
#include <avr/interrupt.h>
#include <avr/io.h>
#include <util/atomic.h>

/* 256 bytes each, so that uint8_t indices wrap by themselves. One side writes each index. */
static volatile uint8_t rx[256], rx_head, rx_tail;
static volatile uint8_t tx[256], tx_head, tx_tail;
static volatile uint16_t errors;

void uart_init(void) {
  UCSR0A = _BV(U2X0); /* before the divisor: emulators take the byte time when UBRR0 is written */
  UBRR0 = (F_CPU + 4 * BAUD) / (8 * BAUD) - 1;
  UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);
  UCSR0B = _BV(RXEN0) | _BV(TXEN0) | _BV(RXCIE0);
}

/* An emergency stop does not wait behind other commands: its frame is known by its bytes, CRC and all. The main loop
 * meets it again in its turn, and answers it. */
static inline void listen_for_estop(uint8_t byte) {
  static const uint8_t frame[] = ESTOP_FRAME;
  static uint8_t heard;
  if (byte != frame[heard]) {
    heard = byte == frame[0];
  } else if (++heard == sizeof frame) {
    heard = 1; /* one delimiter may end a frame and begin the next */
    axes_silence();
    safety_estop_heard = true;
  }
}

ISR(USART0_RX_vect) {
  uint8_t status = UCSR0A, byte = UDR0, head = rx_head, next = head + 1;
  listen_for_estop(byte);
  if (status & (_BV(DOR0) | _BV(FE0))) errors++;
  if (next == rx_tail) {
    errors++;
    return;
  }
  rx[head] = byte;
  rx_head = next;
}

ISR(USART0_UDRE_vect) {
  uint8_t tail = tx_tail;
  if (tail == tx_head) {
    UCSR0B &= ~_BV(UDRIE0);
    return;
  }
  UDR0 = tx[tail];
  tx_tail = tail + 1;
}

bool uart_has_byte(void) { return rx_head != rx_tail; }

uint8_t uart_take(void) {
  uint8_t byte = rx[rx_tail];
  rx_tail++;
  return byte;
}

uint8_t uart_room(void) { return tx_tail - tx_head - 1; }

void uart_put(uint8_t byte) {
  tx[tx_head] = byte;
  tx_head++;
}

void uart_send(void) {
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { UCSR0B |= _BV(UDRIE0); }
}

uint16_t uart_errors(void) {
  uint16_t count;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { count = errors; }
  return count;
}
