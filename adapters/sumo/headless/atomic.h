/* libsumo refers to no function of libatomic.so.1. */
