"""The instruction set: operations, and the bit patterns that mean them (AVR manual, DS40002198)."""

from enum import IntEnum

Op = IntEnum(
    "Op",
    "ADD ADC SUB SBC CP CPC AND OR EOR MOV "
    "COM NEG SWAP INC DEC ASR LSR ROR "
    "LOAD LOAD_INC LOAD_DEC LDS STORE STORE_INC STORE_DEC STS IN OUT PUSH POP "
    "BRBS BRBC CPSE SBRC SBRS SBIC SBIS RJMP JMP IJMP EIJMP RCALL CALL ICALL EICALL RET RETI "
    "MOVW ADIW SBIW MUL MULS MULSU FMUL FMULS FMULSU "
    "SBI CBI BSET BCLR BST BLD LPM LPM_INC ELPM ELPM_INC SPM NOP SLEEP WDR ILLEGAL",
    start=0,
)

# Operation, bits, and what else its operands need: a pointer register (X, Y, Z) or the word behind it (w).
#
# Letters: d, r registers; D, R register pairs; P pair from r24 on; K constant; q displacement; k signed distance in
# words; h high bits of an address; A I/O address; b bit of a byte; s bit of SREG. LDI, CPI and so on are the operations
# of MOV, CP with a constant; LPM without operands is LPM to r0; BREAK does nothing without a debugger.
PATTERNS = """
NOP       0000 0000 0000 0000
MOVW      0000 0001 DDDD RRRR
MULS      0000 0010 dddd rrrr
MULSU     0000 0011 0ddd 0rrr
FMUL      0000 0011 0ddd 1rrr
FMULS     0000 0011 1ddd 0rrr
FMULSU    0000 0011 1ddd 1rrr
CPC       0000 01rd dddd rrrr
SBC       0000 10rd dddd rrrr
ADD       0000 11rd dddd rrrr
CPSE      0001 00rd dddd rrrr
CP        0001 01rd dddd rrrr
SUB       0001 10rd dddd rrrr
ADC       0001 11rd dddd rrrr
AND       0010 00rd dddd rrrr
EOR       0010 01rd dddd rrrr
OR        0010 10rd dddd rrrr
MOV       0010 11rd dddd rrrr
CP        0011 KKKK dddd KKKK
SBC       0100 KKKK dddd KKKK
SUB       0101 KKKK dddd KKKK
OR        0110 KKKK dddd KKKK
AND       0111 KKKK dddd KKKK
MOV       1110 KKKK dddd KKKK
LOAD      10q0 qq0d dddd 1qqq Y
LOAD      10q0 qq0d dddd 0qqq Z
STORE     10q0 qq1d dddd 1qqq Y
STORE     10q0 qq1d dddd 0qqq Z
LDS       1001 000d dddd 0000 w
LOAD_INC  1001 000d dddd 0001 Z
LOAD_DEC  1001 000d dddd 0010 Z
LPM       1001 000d dddd 0100
LPM_INC   1001 000d dddd 0101
ELPM      1001 000d dddd 0110
ELPM_INC  1001 000d dddd 0111
LOAD_INC  1001 000d dddd 1001 Y
LOAD_DEC  1001 000d dddd 1010 Y
LOAD      1001 000d dddd 1100 X
LOAD_INC  1001 000d dddd 1101 X
LOAD_DEC  1001 000d dddd 1110 X
POP       1001 000d dddd 1111
STS       1001 001d dddd 0000 w
STORE_INC 1001 001d dddd 0001 Z
STORE_DEC 1001 001d dddd 0010 Z
STORE_INC 1001 001d dddd 1001 Y
STORE_DEC 1001 001d dddd 1010 Y
STORE     1001 001d dddd 1100 X
STORE_INC 1001 001d dddd 1101 X
STORE_DEC 1001 001d dddd 1110 X
PUSH      1001 001d dddd 1111
COM       1001 010d dddd 0000
NEG       1001 010d dddd 0001
SWAP      1001 010d dddd 0010
INC       1001 010d dddd 0011
ASR       1001 010d dddd 0101
LSR       1001 010d dddd 0110
ROR       1001 010d dddd 0111
DEC       1001 010d dddd 1010
BSET      1001 0100 0sss 1000
BCLR      1001 0100 1sss 1000
IJMP      1001 0100 0000 1001
EIJMP     1001 0100 0001 1001
ICALL     1001 0101 0000 1001
EICALL    1001 0101 0001 1001
RET       1001 0101 0000 1000
RETI      1001 0101 0001 1000
SLEEP     1001 0101 1000 1000
NOP       1001 0101 1001 1000
WDR       1001 0101 1010 1000
LPM       1001 0101 1100 1000
ELPM      1001 0101 1101 1000
SPM       1001 0101 1110 1000
JMP       1001 010h hhhh 110h w
CALL      1001 010h hhhh 111h w
ADIW      1001 0110 KKPP KKKK
SBIW      1001 0111 KKPP KKKK
CBI       1001 1000 AAAA Abbb
SBIC      1001 1001 AAAA Abbb
SBI       1001 1010 AAAA Abbb
SBIS      1001 1011 AAAA Abbb
MUL       1001 11rd dddd rrrr
IN        1011 0AAd dddd AAAA
OUT       1011 1AAd dddd AAAA
RJMP      1100 kkkk kkkk kkkk
RCALL     1101 kkkk kkkk kkkk
BRBS      1111 00kk kkkk ksss
BRBC      1111 01kk kkkk ksss
BLD       1111 100d dddd 0bbb
BST       1111 101d dddd 0bbb
SBRC      1111 110r rrrr 0bbb
SBRS      1111 111r rrrr 0bbb
"""
