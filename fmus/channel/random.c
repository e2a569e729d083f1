#include "random.h"

static uint32_t multiply(uint32_t a, uint32_t b, uint32_t *high) {
    uint64_t product = (uint64_t)a * b;
    *high = (uint32_t)(product >> 32);
    return (uint32_t)product;
}

void philox4x32(const uint32_t counter[4], const uint32_t key[2], uint32_t out[4]) {
    uint32_t c0 = counter[0], c1 = counter[1], c2 = counter[2], c3 = counter[3];
    uint32_t k0 = key[0], k1 = key[1];
    for (int round = 0; round < 10; round++) {
        uint32_t high0, high1;
        uint32_t low0 = multiply(0xD2511F53u, c0, &high0), low1 = multiply(0xCD9E8D57u, c2, &high1);
        uint32_t next0 = high1 ^ c1 ^ k0, next2 = high0 ^ c3 ^ k1;
        c0 = next0, c1 = low1, c2 = next2, c3 = low0;
        k0 += 0x9E3779B9u;
        k1 += 0xBB67AE85u;
    }
    out[0] = c0, out[1] = c1, out[2] = c2, out[3] = c3;
}

/* 53 random bits as a multiple of 2^-53. */
static double unit(uint32_t high, uint32_t low) {
    return (double)((((uint64_t)high << 32) | low) >> 11) * 0x1p-53;
}

Uniforms draw(uint64_t seed, Draw what, int64_t packet, uint16_t hop, int64_t vehicle) {
    uint32_t key[2] = {(uint32_t)seed, (uint32_t)(seed >> 32)}, out[4];
    uint32_t counter[4] = {(uint32_t)packet, (uint32_t)((uint64_t)packet >> 32), (uint32_t)vehicle,
                           (uint32_t)what << 16 | hop};
    philox4x32(counter, key, out);
    return (Uniforms){unit(out[0], out[1]), unit(out[2], out[3])};
}
