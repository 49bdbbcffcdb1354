/* USART0 at BAUD, 8N1, interrupt-driven both ways; never waits. */
#ifndef UART_H
#define UART_H
#include <stdbool.h>
#include <stdint.h>

void uart_init(void);
bool uart_has_byte(void);
uint8_t uart_take(void);   /* only after uart_has_byte() */
uint8_t uart_room(void);   /* bytes uart_put() can take */
void uart_put(uint8_t byte);
void uart_send(void);      /* what was put goes out */
uint16_t uart_errors(void); /* overruns, framing errors, bytes that found the buffer full */

#endif
