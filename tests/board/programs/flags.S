; Runs one arithmetic instruction on all 256 values of its second (or only) operand, for test_arithmetic.py.
; The test puts the routine's word address in Z, the first operand in r21, SREG before in r20, X at the results,
; and a one in r24.

.macro ending
        inc  r19
        brne 1b
        rjmp main
        .p2align 6
.endm

.macro two name                         ; result and SREG
1:      mov  r16, r21
        mov  r17, r19
        out  0x3f, r20
        \name r16, r17
        in   r18, 0x3f
        st   X+, r16
        st   X+, r18
        ending
.endm

.macro one name
1:      mov  r16, r19
        out  0x3f, r20
        \name r16
        in   r18, 0x3f
        st   X+, r16
        st   X+, r18
        ending
.endm

.macro product name                     ; product and SREG
1:      mov  r16, r21
        mov  r17, r19
        out  0x3f, r20
        \name r16, r17
        in   r18, 0x3f
        st   X+, r0
        st   X+, r1
        st   X+, r18
        ending
.endm

        .global main
main:   clr  r24
        clr  r19
wait:   sbrs r24, 0
        rjmp wait
        ijmp
        .p2align 6
        two add
        two adc
        two sub
        two sbc
        two cp
        two cpc
        two and
        two or
        two eor
        one com
        one neg
        one swap
        one inc
        one dec
        one asr
        one lsr
        one ror
        product mul
        product muls
        product mulsu
        product fmul
        product fmuls
        product fmulsu
