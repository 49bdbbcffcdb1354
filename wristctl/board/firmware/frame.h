/* Frames on the wire: 00 | COBS(code, seq, payload, CRC-16/CCITT-FALSE high byte first) | 00. */
#ifndef FRAME_H
#define FRAME_H
#include "messages.h"
#include <stdbool.h>
#include <stdint.h>

struct frame {
  uint8_t code, seq;
  uint8_t payload[MAX_PAYLOAD + 2]; /* the CRC is built behind the payload */
  uint8_t length;                   /* of the payload */
};

uint16_t crc16(const void *of, uint8_t count); /* CRC-16/CCITT-FALSE */
bool frame_receive(struct frame *f); /* reads up to the end of one frame: true where it came whole and sound */
void frame_send(struct frame *f);    /* dropped, and counted, where the host does not read */
extern uint32_t frames_received;
extern uint16_t frames_bad_crc, frames_malformed, frames_dropped;

#endif
