/* The eight OFDM modes of a 10 MHz channel and the duration of a frame. */
#ifndef MODULATION_H
#define MODULATION_H
#include "clock.h"

typedef enum { BPSK, QPSK, QAM16, QAM64 } Constellation;
typedef enum { RATE_1_2 = 1, RATE_2_3 = 2, RATE_3_4 = 3 } CodeRate;

typedef struct {
    double bitrate;          /* [bit/s] */
    uint32_t bits_per_symbol; /* data bits per OFDM symbol, N_DBPS */
    Constellation constellation;
    CodeRate code;
} Mode;

/* Longest frame, preamble and SIGNAL not counted: LENGTH has 12 bits (IEEE 802.11-2020, 17.3.4.3). */
#define FRAME_SIZE_MAX 4095u

#define PREAMBLE (32 * MICROSECOND)

/* The mode of a bit rate [bit/s], or NULL if 802.11p has none. */
const Mode *mode_of_bitrate(double bitrate);

/* Time on air of a frame of `size` bytes, headers included [ps] (IEEE 802.11-2020, 17.4.3,
 * TXTIME, with the times of 10 MHz channel spacing, table 17-5). */
int64_t frame_duration(const Mode *mode, uint32_t size);

#endif
