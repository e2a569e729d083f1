#ifndef PATH_LOSS_H
#define PATH_LOSS_H

/* Loss between isotropic antennas `distance` [m] apart [dB]:
 *     PL = max(0, 20 log10(4 pi / lambda) + 10 alpha log10(d / 1 m)),
 * free space (ITU-R P.525-4, eq. 3) for the exponent alpha = 2. Free space is a far-field formula;
 * cut off at 0 dB it stays finite and continuous down to coincident antennas.
 * No loss up to `lossless_distance` [m] (Veins: 1 m, which makes a step of 48 dB there). */
double path_loss_db(double distance, double wavelength, double exponent, double lossless_distance);

#endif
