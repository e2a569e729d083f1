/* Planes of bytes: the lowest byte of all numbers, then the next one of all, ... `orchestrator/recording/planes.py`
 * says what for, and has the same in NumPy. */
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

#if defined(__has_builtin)
#if __has_builtin(__builtin_shufflevector)
#define HAS_SHUFFLE
#endif
#endif

enum { AT_ONCE = 16 }; /* numbers: a vector for each plane */

/* The planes of `AT_ONCE` numbers of `WIDTH` bytes; plane `b` goes to `to + b * apart`. */
#ifdef HAS_SHUFFLE
typedef uint8_t Vector __attribute__((vector_size(AT_ONCE)));
#define LOW(a, b) __builtin_shufflevector(a, b, 0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23)
#define HIGH(a, b) __builtin_shufflevector(a, b, 8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31)

/* Interleaving two halves rotates the bits of all indices by one. Of four bits for the number and
 * some for its byte, four turns make as many for the byte and then four for the number. */
#define DEFINE_TURN(WIDTH, Type)                                                    \
    static inline void turn##WIDTH(const Type *from, uint8_t *to, size_t apart) {   \
        enum { HALF = WIDTH / 2 };                                                  \
        Vector now[WIDTH], next[WIDTH];                                             \
        memcpy(now, from, sizeof now);                                              \
        for (int turn = 0; turn < 4; turn++) {                                      \
            for (int k = 0; k < HALF; k++) {                                        \
                next[2 * k] = LOW(now[k], now[k + HALF]);                           \
                next[2 * k + 1] = HIGH(now[k], now[k + HALF]);                      \
            }                                                                       \
            memcpy(now, next, sizeof now);                                          \
        }                                                                           \
        for (int b = 0; b < WIDTH; b++) memcpy(to + b * apart, &now[b], AT_ONCE);   \
    }
#else
#define DEFINE_TURN(WIDTH, Type)                                                    \
    static inline void turn##WIDTH(const Type *from, uint8_t *to, size_t apart) {   \
        for (int b = 0; b < WIDTH; b++)                                             \
            for (int k = 0; k < AT_ONCE; k++)                                       \
                to[b * apart + k] = (uint8_t)(from[k] >> (8 * b));                  \
    }
#endif

#define DEFINE_PLANES(WIDTH, Type)                                                        \
    DEFINE_TURN(WIDTH, Type)                                                              \
    static void number##WIDTH(Type number, uint8_t *to, size_t apart) {                   \
        for (int b = 0; b < WIDTH; b++) to[b * apart] = (uint8_t)(number >> (8 * b));     \
    }                                                                                     \
    static void planes##WIDTH(const Type *from, size_t n, uint8_t *to) {                  \
        size_t i = 0;                                                                     \
        for (; i + AT_ONCE <= n; i += AT_ONCE) turn##WIDTH(from + i, to + i, n);          \
        for (; i < n; i++) number##WIDTH(from[i], to + i, n);                             \
    }                                                                                     \
    static void deltas##WIDTH(const Type *from, size_t n, uint8_t *to) {                  \
        size_t i = 1;                                                                     \
        if (n > 0) number##WIDTH(from[0], to, n);                                         \
        for (; i + AT_ONCE <= n; i += AT_ONCE) {                                          \
            Type delta[AT_ONCE];                                                          \
            for (int k = 0; k < AT_ONCE; k++) delta[k] = from[i + k] - from[i + k - 1];   \
            turn##WIDTH(delta, to + i, n);                                                \
        }                                                                                 \
        for (; i < n; i++) number##WIDTH(from[i] - from[i - 1], to + i, n);               \
    }
DEFINE_PLANES(2, uint16_t)
DEFINE_PLANES(4, uint32_t)
DEFINE_PLANES(8, uint64_t)

/* The planes of `n` numbers of 2, 4 or 8 bytes, n bytes each; with `are_deltas` of their differences to the
 * one before, without carry, of the first one to zero. */
EXPORT void column_planes(const void *from, size_t n, size_t width, int are_deltas, uint8_t *to) {
    switch (width) {
    case 2: (are_deltas ? deltas2 : planes2)(from, n, to); break;
    case 4: (are_deltas ? deltas4 : planes4)(from, n, to); break;
    case 8: (are_deltas ? deltas8 : planes8)(from, n, to); break;
    default: break;
    }
}
