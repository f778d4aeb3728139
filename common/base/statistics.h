#pragma once

namespace kiln {

// z with P(|Z| < z) = confidence for a standard normal Z: 0.95 -> 1.959964. 0 < confidence < 1.
// Solved by bisection on erf, to the last bit of double.
double normal_interval(double confidence);

}  // namespace kiln
