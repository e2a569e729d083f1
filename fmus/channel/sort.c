#include "sort.h"
#include <stdbool.h>

static bool is_smaller(const uint64_t *a, const uint64_t *b) { return *a < *b; }

DEFINE_INSERTION_SORT(insertion_sort, uint64_t, is_smaller)

static void merge(const uint64_t *a, size_t na, const uint64_t *b, size_t nb, uint64_t *out) {
    size_t i = 0, k = 0, to = 0;
    while (i < na && k < nb) out[to++] = a[i] <= b[k] ? a[i++] : b[k++];
    if (i < na) memcpy(out + to, a + i, (na - i) * sizeof *a);
    if (k < nb) memcpy(out + to, b + k, (nb - k) * sizeof *b);
}

/* Merge sort from short runs on. */
void sort_keys(uint64_t *key, uint64_t *scratch, size_t n) {
    enum { RUN = 16 };
    uint64_t *from = key, *to = scratch;
    for (size_t k = 0; k < n; k += RUN) insertion_sort(key + k, n - k < RUN ? n - k : RUN);
    for (size_t width = RUN; width < n; width *= 2) {
        for (size_t k = 0; k < n; k += 2 * width) {
            size_t na = n - k < width ? n - k : width, nb = n - k - na < width ? n - k - na : width;
            merge(from + k, na, from + k + na, nb, to + k);
        }
        uint64_t *sorted = to;
        to = from;
        from = sorted;
    }
    if (from != key) memcpy(key, from, n * sizeof *key);
}
