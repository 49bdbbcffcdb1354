/* The motor board on libsimavr, stepped in virtual time: bytes in and out at the line's pace, pin changes with cycle
 * stamps. Used through ctypes by simavr_board.py. Links to simavr (GPL-3): a test tool, never part of the wheel.
 *
 * What simavr 1.6 does otherwise than the chip, and is mended or avoided here:
 *  - an 8N1 byte lasts 11 bits: cycles_per_byte is scaled in board_run();
 *  - a pull-up is applied again at each write to PORT or DDR: driven inputs are declared external;
 *  - a compare at 0 never matches: compare_at_zero() raises its interrupt;
 *  - WDR renews avr_run()'s cycle budget: an own timer ends each run on time;
 *  - its receive buffer holds 64 bytes where the chip's holds 2, so it never shows an overrun.                         */
#include <avr_ioport.h>
#include <avr_timer.h>
#include <avr_uart.h>
#include <sim_avr.h>
#include <sim_elf.h>
#include <sim_hex.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define CLOCK 16000000u
#define OLDEST_CALL 4000u /* cycles avr_run() may take before it looks at our bytes again */

struct event {
  uint64_t cycle;
  uint8_t port, value, unused[6];
};

struct bytes {
  uint8_t *data;
  size_t count, taken, room;
};

struct compare_write { /* the timer's own handler of writes to OCRnA, which ours calls first */
  avr_timer_t *timer;
  avr_io_write_t handler;
  void *param;
};

struct board {
  avr_t *avr;
  avr_uart_t *uart;
  avr_irq_t *receive;
  uint32_t byte_cycles;
  int receiving;
  struct bytes to_board, from_board;
  struct event *events;
  size_t event_count, event_room;
  struct compare_write compares[8];
  uint8_t level[256], driven[256], drive_level[256]; /* by port letter */
};

static void append(struct bytes *b, const uint8_t *data, size_t count) {
  if (b->taken == b->count) b->taken = b->count = 0;
  if (b->count + count > b->room) b->data = realloc(b->data, b->room = 2 * (b->count + count));
  memcpy(b->data + b->count, data, count);
  b->count += count;
}

static void on_sent_byte(avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq;
  uint8_t byte = (uint8_t)value;
  append(&((struct board *)param)->from_board, &byte, 1);
}

static avr_cycle_count_t deliver_byte(avr_t *avr, avr_cycle_count_t when, void *param) {
  (void)avr;
  struct board *b = param;
  avr_raise_irq(b->receive, b->to_board.data[b->to_board.taken++]);
  if (b->to_board.taken < b->to_board.count) return when + b->byte_cycles;
  b->receiving = 0;
  return 0;
}

static void note_port(struct board *b, uint8_t port, uint8_t value) {
  if (b->level[port] == value) return;
  b->level[port] = value;
  if (b->event_count == b->event_room)
    b->events = realloc(b->events, (b->event_room = 2 * b->event_room + 1024) * sizeof *b->events);
  b->events[b->event_count++] = (struct event){.cycle = b->avr->cycle, .port = port, .value = value};
}

static void on_port_a(avr_irq_t *irq, uint32_t value, void *b) { (void)irq, note_port(b, 'A', (uint8_t)value); }
static void on_port_c(avr_irq_t *irq, uint32_t value, void *b) { (void)irq, note_port(b, 'C', (uint8_t)value); }
static void on_port_f(avr_irq_t *irq, uint32_t value, void *b) { (void)irq, note_port(b, 'F', (uint8_t)value); }
static void no_sleep(avr_t *avr, avr_cycle_count_t cycles) { (void)avr, (void)cycles; }
static void no_log(avr_t *avr, const int level, const char *format, va_list args) {
  (void)avr, (void)level, (void)format, (void)args;
}

static avr_cycle_count_t compare_at_zero(avr_t *avr, avr_cycle_count_t when, void *timer) {
  avr_raise_interrupt(avr, &((avr_timer_t *)timer)->comp[AVR_TIMER_COMPA].interrupt);
  return when + 0x10000;
}

static void on_compare_write(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  struct compare_write *w = param;
  w->handler(avr, address, value, w->param);
  avr_cycle_timer_cancel(avr, compare_at_zero, w->timer);
  if (value == 0 && avr->data[w->timer->comp[AVR_TIMER_COMPA].r_ocrh] == 0)
    avr_cycle_timer_register(avr, w->timer->tov_base + 0x10000 - avr->cycle, compare_at_zero, w->timer);
}

static void watch_compare(struct board *b, avr_timer_t *timer) {
  struct compare_write *w = &b->compares[timer->name - '0'];
  avr_io_addr_t io = AVR_DATA_TO_IO(timer->comp[AVR_TIMER_COMPA].r_ocr);
  *w = (struct compare_write){timer, b->avr->io[io].w.c, b->avr->io[io].w.param};
  b->avr->io[io].w.c = on_compare_write;
  b->avr->io[io].w.param = w;
}

static void apply_drive(struct board *b, uint8_t port) {
  avr_ioport_external_t external = {.name = port, .mask = b->driven[port], .value = b->drive_level[port]};
  avr_ioctl(b->avr, AVR_IOCTL_IOPORT_SET_EXTERNAL(port), &external);
  for (int bit = 0; bit < 8; bit++)
    if (b->driven[port] >> bit & 1)
      avr_raise_irq(avr_io_getirq(b->avr, AVR_IOCTL_IOPORT_GETIRQ(port), bit), b->drive_level[port] >> bit & 1);
}

void board_drive(struct board *b, uint8_t port, int bit, int level) {
  b->driven[port] |= 1 << bit;
  b->drive_level[port] = (b->drive_level[port] & ~(1 << bit)) | level << bit;
  apply_drive(b, port);
}

void board_reset(struct board *b) {
  avr_cycle_count_t cycle = b->avr->cycle;
  avr_reset(b->avr);
  b->avr->cycle = cycle;
  b->receiving = 0;
  for (int port = 'A'; port <= 'L'; port++)
    if (b->driven[port]) apply_drive(b, (uint8_t)port);
}

void board_set_baud(struct board *b, uint32_t baud) { b->byte_cycles = 10 * CLOCK / baud; }

struct board *board_new(const char *hex, uint32_t baud, int start_in_bootloader) {
  elf_firmware_t firmware = {.frequency = CLOCK};
  avr_global_logger_set(no_log);
  firmware.flash = read_ihex_file(hex, &firmware.flashsize, &firmware.flashbase);
  if (!firmware.flash) return NULL;
  struct board *b = calloc(1, sizeof *b);
  avr_t *avr = b->avr = avr_make_mcu_by_name("atmega2560");
  avr_init(avr);
  avr_load_firmware(avr, &firmware);
  avr->frequency = CLOCK;
  avr->sleep = no_sleep;
  if (start_in_bootloader) avr->pc = avr->reset_pc = firmware.flashbase; /* what the fuse BOOTRST does */
  uint32_t flags = 0;
  avr_ioctl(avr, AVR_IOCTL_UART_GET_FLAGS('0'), &flags);
  flags &= ~(uint32_t)(AVR_UART_FLAG_STDIO | AVR_UART_FLAG_POLL_SLEEP);
  avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
  for (avr_io_t *io = avr->io_port; io; io = io->next) {
    if (!io->kind) continue;
    if (!strcmp(io->kind, "uart") && ((avr_uart_t *)io)->name == '0') b->uart = (avr_uart_t *)io;
    if (!strcmp(io->kind, "timer") && strchr("1345", ((avr_timer_t *)io)->name)) watch_compare(b, (avr_timer_t *)io);
  }
  b->receive = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
  board_set_baud(b, baud);
  avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), on_sent_byte, b);
  avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('A'), IOPORT_IRQ_PIN_ALL), on_port_a, b);
  avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('C'), IOPORT_IRQ_PIN_ALL), on_port_c, b);
  avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('F'), IOPORT_IRQ_PIN_ALL), on_port_f, b);
  return b;
}

static avr_cycle_count_t end_of_run(avr_t *avr, avr_cycle_count_t when, void *param) {
  (void)avr, (void)when, (void)param;
  return 0;
}

int board_run(struct board *b, uint64_t cycles) {
  avr_t *avr = b->avr;
  uint64_t end = avr->cycle + cycles;
  if (b->uart->cycles_per_byte % 11 == 0) b->uart->cycles_per_byte = b->uart->cycles_per_byte / 11 * 10;
  if (!b->receiving && b->to_board.taken < b->to_board.count) {
    b->receiving = 1;
    avr_cycle_timer_register(avr, b->byte_cycles, deliver_byte, b);
  }
  avr_cycle_timer_register(avr, cycles, end_of_run, b);
  while (avr->cycle < end) {
    uint64_t left = end - avr->cycle;
    avr->run_cycle_limit = left < OLDEST_CALL ? left : OLDEST_CALL;
    int state = avr_run(avr);
    if (state == cpu_Done || state == cpu_Crashed) return state;
  }
  avr_cycle_timer_cancel(avr, end_of_run, b);
  return 0;
}

/* Out of any interrupt first, then on from another place: a main program that has lost its way. */
uint32_t board_jump(struct board *b, uint32_t address) {
  while (!b->avr->sreg[S_I]) board_run(b, 1);
  uint32_t from = b->avr->pc;
  b->avr->pc = address;
  return from;
}

void board_write(struct board *b, const uint8_t *data, size_t count) { append(&b->to_board, data, count); }
size_t board_sent(struct board *b) { return b->from_board.count - b->from_board.taken; }
void board_take_sent(struct board *b, uint8_t *out) {
  memcpy(out, b->from_board.data + b->from_board.taken, board_sent(b));
  b->from_board.taken = b->from_board.count;
}
size_t board_event_count(struct board *b) { return b->event_count; }
void board_take_events(struct board *b, struct event *out) {
  memcpy(out, b->events, b->event_count * sizeof *out);
  b->event_count = 0;
}
uint64_t board_cycles(struct board *b) { return b->avr->cycle; }
uint8_t board_port(struct board *b, uint8_t port) { return b->level[port]; }
void board_poke(struct board *b, uint16_t address, uint8_t value) { b->avr->data[address] = value; }

void board_free(struct board *b) {
  avr_terminate(b->avr);
  free(b->to_board.data), free(b->from_board.data), free(b->events), free(b);
}
