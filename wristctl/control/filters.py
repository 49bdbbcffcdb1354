"""Filters that laws may carry: low-pass, dirty derivative, notch, biquad and rate limiter.

`low_pass(x, cutoff, period, memory, first)` is called once a tick and keeps its state in `memory`, from `first` on:
as many values as `LOW_PASS` says, and so for the others. A filter begins settled, as if its first input had been
there for ever. Frequencies are in rad/s; every filter is stable at any frequency and period, and may change both
from tick to tick.
"""

from typing import Any

from wristctl.lanes.compiled import compiled
from wristctl.lanes.functions import clip, cos, expm1_of_negative, maximum, minimum, sin
from wristctl.lanes.lane import where, zero_like

# Values of memory that each needs.
LOW_PASS, DERIVATIVE, NOTCH, BIQUAD, RATE_LIMIT = 3, 3, 3, 3, 2

# Least angle of a period that a first-order filter works with [rad], and the largest of a notch: 0.95 of Nyquist's.
_LEAST, _MOST = 1e-9, 3.0
_SQRT_2 = 2.0**0.5


@compiled
def low_pass(x: Any, cutoff: Any, period: Any, memory: Any, first: int) -> Any:
    """w/(s + w) of x, w the cutoff [rad/s]: first-order hold, exact for inputs that are straight between ticks.

    With a = exp(-w T) and b = (1 - a)/(w T) it is y_k = a y_(k-1) + (1 - b) x_k + (b - a) x_(k-1) (Franklin, Powell
    and Workman, Digital Control of Dynamic Systems, section 6.3.2). Memory: y, x, and whether it has begun.
    """
    before = where(memory[first + 2] > 0.0, memory[first + 1], x)
    held = where(memory[first + 2] > 0.0, memory[first], x)
    angle = maximum(cutoff * period, _LEAST)
    left = -expm1_of_negative(-angle)
    straight = left / angle
    y = held + left * (before - held) + (1.0 - straight) * (x - before)
    memory[first] = y
    memory[first + 1] = x
    memory[first + 2] = 1.0 + zero_like(x)
    return y


@compiled
def derivative(x: Any, bandwidth: Any, period: Any, memory: Any, first: int) -> Any:
    """w s/(s + w) of x, w the bandwidth [rad/s]: the rate of x, low-passed; first-order hold as `low_pass`.

    y_k = a y_(k-1) + (1 - a) (x_k - x_(k-1))/T: the slope of a ramp in the end, and of an infinite bandwidth the plain
    difference. Memory: y, x, and whether it has begun, with no rate.
    """
    before = where(memory[first + 2] > 0.0, memory[first + 1], x)
    held = memory[first]
    y = held - expm1_of_negative(-bandwidth * period) * ((x - before) / period - held)
    memory[first] = y
    memory[first + 1] = x
    memory[first + 2] = 1.0 + zero_like(x)
    return y


@compiled
def notch(x: Any, frequency: Any, damping: Any, period: Any, memory: Any, first: int) -> Any:
    """(s^2 + w^2)/(s^2 + 2 z w s + w^2) of x: nothing at the frequency w [rad/s], all at 0 and far above.

    2 z w is its width at -3 dB, z the `damping` of its poles. Tustin's rule, prewarped so that the notch lies at w
    exactly: b0 = b2 = 1/(1 + g), b1 = a1 = -2 cos(w T)/(1 + g) and a2 = (1 - g)/(1 + g) with g = z sin(w T). A notch
    beyond 0.95 of Nyquist's frequency is one there. Memory as `biquad`.
    """
    angle = minimum(frequency * period, _MOST)
    scale = 1.0 / (1.0 + damping * sin(angle))
    turning = -2.0 * cos(angle) * scale
    return biquad(x, (scale, turning, scale, turning, 2.0 * scale - 1.0), memory, first)


@compiled
def biquad(x: Any, coefficients: Any, memory: Any, first: int) -> Any:
    """(b0 + b1/z + b2/z^2)/(1 + a1/z + a2/z^2) of x, `coefficients` (b0, b1, b2, a1, a2): direct form II transposed.

    Numbers of a design for one control period, as `scipy.signal` gives them in its sections (b0, b1, b2, 1, a1, a2),
    or lanes. It begins settled where it has a gain at rest, else empty. Memory: its two states, and whether it has
    begun.
    """
    b0, b1, b2, a1, a2 = coefficients
    at_rest = 1.0 + a1 + a2 + zero_like(x)
    settled = where(abs(at_rest) > 0.0, (b0 + b1 + b2) * x / at_rest, b0 * x)
    has_begun = memory[first + 2] > 0.0
    state = where(has_begun, memory[first], settled - b0 * x)
    next_state = where(has_begun, memory[first + 1], where(abs(at_rest) > 0.0, b2 * x - a2 * settled, 0.0))
    y = b0 * x + state
    memory[first] = b1 * x - a1 * y + next_state
    memory[first + 1] = b2 * x - a2 * y
    memory[first + 2] = 1.0 + zero_like(x)
    return y


@compiled
def rate_limited(x: Any, limit: Any, period: Any, memory: Any, first: int) -> Any:
    """x, which changes by at most `limit` a second. Memory: the output, and whether it has begun."""
    held = where(memory[first + 1] > 0.0, memory[first], x)
    y = held + clip(x - held, -limit * period, limit * period)
    memory[first] = y
    memory[first + 1] = 1.0 + zero_like(x)
    return y


@compiled
def low_pass_both_ways(values: Any, count: int, cutoff: Any, period: Any, memory: Any, first: int) -> None:
    """Low-pass the first `count` of `values`, `period` apart, forward and then back, so that nothing is late.

    Each way it is Butterworth's filter of second order by Tustin's rule, prewarped at the cutoff w [rad/s], so that
    both pass 1/(1 + (f/w)^4) of a frequency f well below the rate of the values. Each way begins settled. Memory as
    `biquad`.
    """
    angle = 0.5 * minimum(cutoff * period, _MOST)
    warped = sin(angle) / cos(angle)
    square = warped * warped
    scale = 1.0 / (1.0 + _SQRT_2 * warped + square)
    gain = square * scale
    coefficients = gain, 2.0 * gain, gain, 2.0 * (square - 1.0) * scale, (1.0 - _SQRT_2 * warped + square) * scale
    memory[first + 2] = zero_like(angle)
    for i in range(count):
        values[i] = biquad(values[i], coefficients, memory, first)
    memory[first + 2] = zero_like(angle)
    for i in range(count):
        values[count - 1 - i] = biquad(values[count - 1 - i], coefficients, memory, first)
