#include "modulation.h"
#include <stddef.h>

/* IEEE 802.11-2020, table 17-4, 10 MHz channel spacing. */
static const Mode MODES[] = {
    {3.0e6, 24, BPSK, RATE_1_2},   {4.5e6, 36, BPSK, RATE_3_4},   {6e6, 48, QPSK, RATE_1_2},
    {9e6, 72, QPSK, RATE_3_4},     {12e6, 96, QAM16, RATE_1_2},   {18e6, 144, QAM16, RATE_3_4},
    {24e6, 192, QAM64, RATE_2_3},  {27e6, 216, QAM64, RATE_3_4},
};

const Mode *mode_of_bitrate(double bitrate) {
    for (size_t i = 0; i < sizeof MODES / sizeof *MODES; i++)
        if (MODES[i].bitrate == bitrate) return &MODES[i];
    return NULL;
}

int64_t frame_duration(const Mode *mode, uint32_t size) {
    const int64_t signal = 8 * MICROSECOND, symbol = 8 * MICROSECOND;
    uint32_t bits = 16 + 8 * size + 6; /* SERVICE, frame, tail */
    uint32_t symbols = (bits + mode->bits_per_symbol - 1) / mode->bits_per_symbol;
    return PREAMBLE + signal + symbol * (int64_t)symbols;
}
