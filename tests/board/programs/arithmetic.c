/* Arithmetic on pseudo-random numbers: every flag, soft float, 64-bit division. Sends a hash of it all (FNV-1a), four
 * bytes at 1 Mbaud. test_differential.py compares hash and cycles of two emulators. */
#include <avr/io.h>
#include <math.h>
#include <stdint.h>

static uint32_t hash = 2166136261u, state = 12345;

static void add(uint8_t byte) {
  hash ^= byte;
  hash *= 16777619u;
}

static uint8_t next(void) {
  state ^= state << 13;
  state ^= state >> 17;
  state ^= state << 5;
  return state;
}

#define CARRY "clr __tmp_reg__\n\t out __SREG__,__tmp_reg__\n\t sbrc %2,0\n\t sec\n\t"
#define FLAGS "\n\t in %1,__SREG__"
#define ONE(name) { uint8_t a = next(), c = next(), s; asm volatile(CARRY name " %0" FLAGS : "+r"(a), "=&r"(s) : "r"(c)); add(a); add(s); }
#define TWO(name) { uint8_t a = next(), b = next(), c = next(), s; asm volatile(CARRY name " %0,%3" FLAGS : "+r"(a), "=&r"(s) : "r"(c), "r"(b)); add(a); add(s); }
#define CONSTANT(name, k) { uint8_t a = next(), c = next(), s; asm volatile(CARRY name " %0," #k FLAGS : "+d"(a), "=&r"(s) : "r"(c)); add(a); add(s); }
#define WIDE(name, k) { uint16_t a = next() | next() << 8; uint8_t c = next(), s; asm volatile(CARRY name " %A0," #k FLAGS : "+w"(a), "=&r"(s) : "r"(c)); add(a); add(a >> 8); add(s); }
#define PRODUCT(name) { uint8_t a = next(), b = next(), s; uint16_t r; asm volatile("clr r0\n\t out __SREG__,r0\n\t" name " %2,%3\n\t in %1,__SREG__\n\t movw %0,r0\n\t clr r1" : "=&r"(r), "=&r"(s) : "a"(a), "a"(b)); add(r); add(r >> 8); add(s); }

int main(void) {
  UCSR0A = _BV(U2X0);
  UBRR0 = 1;
  UCSR0B = _BV(TXEN0);
  volatile float f = 1.5f;
  volatile int64_t q = 123456789012345LL;
  for (uint16_t i = 0; i < 400; i++) {
    TWO("add") TWO("adc") TWO("sub") TWO("sbc") TWO("and") TWO("or") TWO("eor") TWO("cp") TWO("cpc")
    ONE("com") ONE("neg") ONE("inc") ONE("dec") ONE("asr") ONE("lsr") ONE("ror") ONE("swap")
    CONSTANT("subi", 37) CONSTANT("sbci", 200) CONSTANT("andi", 0x5a) CONSTANT("ori", 0x81) CONSTANT("cpi", 99)
    WIDE("adiw", 1) WIDE("adiw", 63) WIDE("sbiw", 1) WIDE("sbiw", 63)
    PRODUCT("mul") PRODUCT("muls") PRODUCT("mulsu") PRODUCT("fmul") PRODUCT("fmuls") PRODUCT("fmulsu")
    f = sqrtf(f * 3.25f + 0.37f) + (float)next() / 7.f;
    uint32_t bits;
    __builtin_memcpy(&bits, (void *)&f, 4);
    for (uint8_t k = 0; k < 32; k += 8) add(bits >> k);
    q = (q * 31 + (int64_t)(next() - 128) * 1000003) / (int64_t)((int8_t)next() | 1);
    for (uint8_t k = 0; k < 64; k += 8) add(q >> k);
  }
  for (uint8_t k = 0; k < 32; k += 8) {
    while (!(UCSR0A & _BV(UDRE0))) {
    }
    UDR0 = hash >> k;
  }
  for (;;) {
  }
}
