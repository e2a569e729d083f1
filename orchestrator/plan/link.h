/* Steps of a component in another process: a command goes there, and a reply comes back.
 *
 * On this machine what the component reads and gives may lie in memory that both processes see; a message then says no more than
 * that there is something. Messages are those of `orchestrator.remote.protocol`. Only the usual reply is understood here: any other one, and
 * whatever else happens to a link, is for Python, which gets what came of it. Over other links Python sends and receives. */
#ifndef LINK_H
#define LINK_H
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#ifdef __linux__
#include <errno.h>
#include <sys/socket.h>
#endif

/* Where things are in a message, behind the length that is in front of it [byte]. */
enum { REPLY = 56, SEQUENCE = 24, TIME = 32, LENGTH = 40, SLOT = 56, CHANGED = 57 };

typedef void (*Say)(void);   /* sends the command */
typedef int32_t (*Hear)(void); /* waits for some time; whether the reply was the usual one, whose outputs lie where they should */

typedef struct {
    Say say; /* NULL: messages go over a socket */
    Hear hear;
    uint8_t *command; /* that was sent last; `SLOT` says where outputs go, and `CHANGED`, a byte for each, which inputs are new */
    size_t size, inputs;
    uint8_t *slot[2]; /* where the outputs come to lie */
    uint64_t sequence; /* of the command */
    size_t came; /* of the reply, as far as it is no usual one or has not all come */
    uint8_t reply[REPLY], usual[REPLY];
    int32_t descriptor; /* of the socket; it waits for some time only */
    int32_t is_begun;   /* a step was begun, and is not done yet */
    int32_t is_handed;  /* Python waits for it */
    int32_t pad;
} Link;

static int link_changed(Link *link, const uint32_t *reference, size_t references) {
    for (size_t k = 0; k < references; k++) link->command[CHANGED + reference[k]] = 1;
    return 0;
}

#ifdef __linux__
/* That a command cannot be sent is found out by the reply. */
static void link_send(const Link *link) {
    for (size_t sent = 0; sent < link->size;) {
        ssize_t n = send(link->descriptor, link->command + sent, link->size - sent, MSG_NOSIGNAL);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) break;
        sent += (size_t)n;
    }
}

/* Whether the usual reply comes. */
static bool link_receive(Link *link) {
    while (link->came < REPLY) {
        ssize_t n = recv(link->descriptor, link->reply + link->came, REPLY - link->came, 0);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return false;
        link->came += (size_t)n;
    }
    return memcmp(link->reply, link->usual, REPLY) == 0;
}
#else /* no memory is shared there */
static void link_send(const Link *link) { (void)link; }
static bool link_receive(Link *link) { return link->came == REPLY; }
#endif

/* Begin a step; its outputs will lie where those that others see do not. */
static void link_begin(Link *link, int64_t t, int64_t h, const uint8_t *published) {
    link->sequence++;
    link->command[SLOT] = published == link->slot[0];
    memcpy(link->command + SEQUENCE, &link->sequence, 8);
    memcpy(link->command + TIME, &t, 8);
    memcpy(link->command + LENGTH, &h, 8);
    memcpy(link->usual + SEQUENCE, &link->sequence, 8);
    link->is_begun = 1, link->is_handed = 0, link->came = 0;
    if (link->say) link->say();
    else link_send(link);
    memset(link->command + CHANGED, 0, link->inputs);
}

/* Wait for the end of a step; where its outputs are, or NULL: Python has to. */
static uint8_t *link_end(Link *link) {
    if (link->is_handed || !(link->say ? link->hear() : link_receive(link))) return NULL;
    link->is_begun = 0;
    return link->slot[link->command[SLOT]];
}
#endif
