#include "error_rate.h"
#include "decibel.h"
#include <math.h>

/* Bit error rate before decoding, at symbol SNIR `snir`. */
static double uncoded_error_rate(Constellation constellation, double snir) {
    switch (constellation) {
    case BPSK: return 0.5 * complementary_error(sqrt(snir));
    case QPSK: return 0.5 * complementary_error(sqrt(snir / 2));
    case QAM16: return 3.0 / 8 * complementary_error(sqrt(snir / 10));
    default: return 7.0 / 24 * complementary_error(sqrt(snir / 42));
    }
}

/* Union bound on the error events of the convolutional code (g0 = 133, g1 = 171 octal; punctured):
 *     p_e = 1 / (2 b) sum_k a_k D^k, at most 1, with D = sqrt(4 p (1 - p)).
 * The coefficients a_k are the first ones of the code's weight spectrum. */
static double coded_error_rate(CodeRate code, double p) {
    static const double HALF[] = {36, 211, 1404, 11633, 77433, 502690, 3322763, 21292910, 134365911};
    static const double TWO_THIRDS[] = {3,     70,     285,    1276,    6160,
                                        27128, 117019, 498860, 2103891, 8784123};
    static const double THREE_QUARTERS[] = {42,     201,     1492,     10469,    62935,
                                            379644, 2253373, 13073811, 75152755, 428005675};
    double d_square = 4 * p * (1 - p), d = sqrt(d_square);
    const double *a;
    int terms, lowest; /* number of terms, lowest power of D */
    double step;       /* from one power to the next */
    switch (code) {
    case RATE_1_2: a = HALF, terms = 9, lowest = 10, step = d_square; break;
    case RATE_2_3: a = TWO_THIRDS, terms = 10, lowest = 6, step = d; break;
    default: a = THREE_QUARTERS, terms = 10, lowest = 5, step = d; break;
    }
    double sum = 0;
    for (int k = terms - 1; k >= 0; k--) sum = sum * step + a[k];
    for (int k = 0; k < lowest; k++) sum *= d;
    return fmin(sum / (2.0 * (double)code), 1);
}

double success_probability(const Mode *mode, double snir, double bits) {
    double error = coded_error_rate(mode->code, uncoded_error_rate(mode->constellation, snir));
    return error < 1 ? exponential(bits * natural_logarithm_of_one_plus(-error)) : 0;
}

double header_success_probability(double snir) {
    static const Mode SIGNAL = {3e6, 24, BPSK, RATE_1_2};
    return success_probability(&SIGNAL, snir, 24);
}

double payload_success_probability(const Mode *mode, double snir, uint32_t size) {
    return success_probability(mode, snir, 16 + 8.0 * size + 6);
}

double certain_snir_db(const Mode *mode) {
    double snir_db = 0; /* at most about 30 dB for the fastest mode */
    for (;; snir_db += 0.1) {
        double snir = from_db(snir_db);
        if (header_success_probability(snir) == 1
            && payload_success_probability(mode, snir, FRAME_SIZE_MAX) == 1)
            return snir_db;
    }
}
