#include "frame.h"
#include "uart.h"
#include <util/crc16.h>

#define HEAD 2 /* code, seq */
#define CRC 2
#define LONGEST (HEAD + MAX_PAYLOAD + CRC)

uint32_t frames_received;
uint16_t frames_bad_crc, frames_malformed, frames_dropped;

static uint8_t encoded[LONGEST + 1]; /* COBS adds one byte below 254 */
static uint8_t encoded_length;
static bool overlong;

uint16_t crc16(const void *of, uint8_t count) {
  const uint8_t *bytes = of;
  uint16_t crc = 0xFFFF;
  while (count--) crc = _crc_xmodem_update(crc, *bytes++);
  return crc;
}

/* Decode in place; 0 where the bytes are no COBS. */
static uint8_t decode(uint8_t *bytes, uint8_t count) {
  uint8_t from = 0, to = 0;
  while (from < count) {
    uint8_t block = bytes[from++];
    if (block - 1 > count - from) return 0;
    while (--block) bytes[to++] = bytes[from++];
    if (from < count) bytes[to++] = 0;
  }
  return to;
}

static bool accept(struct frame *f) {
  uint8_t length = overlong ? 0 : decode(encoded, encoded_length);
  if (length < HEAD + CRC) {
    frames_malformed++;
    return false;
  }
  length -= CRC;
  if (crc16(encoded, length) != ((uint16_t)encoded[length] << 8 | encoded[length + 1])) {
    frames_bad_crc++;
    return false;
  }
  f->code = encoded[0];
  f->seq = encoded[1];
  f->length = length - HEAD;
  for (uint8_t i = 0; i < f->length; i++) f->payload[i] = encoded[HEAD + i];
  frames_received++;
  return true;
}

bool frame_receive(struct frame *f) {
  while (uart_has_byte()) {
    uint8_t byte = uart_take();
    if (byte) {
      if (encoded_length < sizeof encoded)
        encoded[encoded_length++] = byte;
      else
        overlong = true;
    } else if (encoded_length) { /* delimiters in a row are no frames */
      bool sound = accept(f);
      encoded_length = 0;
      overlong = false;
      return sound; /* also of a bad one: the main loop has more to do than to read noise */
    }
  }
  return false;
}

static void put_encoded(const uint8_t *bytes, uint8_t count) {
  uint8_t start = 0;
  for (;;) {
    uint8_t end = start;
    while (end < count && bytes[end]) end++;
    uart_put(end - start + 1);
    while (start < end) uart_put(bytes[start++]);
    if (end == count) return;
    start = end + 1;
  }
}

void frame_send(struct frame *f) {
  uint8_t *bytes = &f->code, count = HEAD + f->length;
  uint16_t crc = crc16(bytes, count);
  bytes[count] = crc >> 8;
  bytes[count + 1] = crc;
  count += CRC;
  if (uart_room() < count + 3) { /* two delimiters and the COBS byte: never wait for a host that does not read */
    frames_dropped++;
    return;
  }
  uart_put(0);
  put_encoded(bytes, count);
  uart_put(0);
  uart_send();
}
