#include "worker/bvh_item.h"

float round_down(double x)
{
    if (x > (double)FLT_MAX) return FLT_MAX;
    if (x <= -(double)FLT_MAX) return -FLT_MAX;
    float rounded = (float)x;
    if (rounded == 0) return -FLT_TRUE_MIN;
    uint32_t bits; /* sign and magnitude */
    memcpy(&bits, &rounded, sizeof bits);
    bits += rounded > 0 ? UINT32_MAX : 1;
    memcpy(&rounded, &bits, sizeof bits);
    return rounded < -FLT_MAX ? -FLT_MAX : rounded;
}

float round_up(double x)
{
    return -round_down(-x);
}
