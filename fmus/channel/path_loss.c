#include "path_loss.h"
#include "geometry.h"
#include <math.h>

double path_loss_db(double distance, double wavelength, double exponent, double lossless_distance) {
    if (distance <= lossless_distance || distance <= 0) return 0;
    double loss = 20 * log10(4 * PI / wavelength) + 10 * exponent * log10(distance);
    return loss > 0 ? loss : 0;
}
