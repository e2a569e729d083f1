#include "link.h"
#include "path_loss.h"
#include "records.h"
#include <stdlib.h>
#include <string.h>

int links_forget(Links *s, size_t vehicles) {
    if (vehicles > s->side) {
        size_t side = vehicles + vehicles / 4;
        free(s->known);
        /* zeroed pages cost nothing until links on them are needed */
        s->known = calloc(side, side * sizeof *s->known);
        s->side = s->known ? side : 0;
        s->era = 0;
        if (!s->known) return 1;
    }
    if (++s->era == 0) { /* the counter has wrapped */
        memset(s->known, 0, s->side * s->side * sizeof *s->known);
        s->era = 1;
    }
    return 0;
}

void links_free(Links *s) {
    free(s->known);
    *s = (Links){0};
}

static Link compute(Scene *s, const Parameters *p, size_t from, size_t to) {
    Position a = s->antenna[from], b = s->antenna[to];
    Link link = {path_loss_db(distance_between(a, b), p->wavelength, p->path_loss_exponent,
                              p->lossless_distance), 0, LOS};
    if (p->vehicle_shadowing) {
        EdgeModel model = {p->wavelength, p->knife_edge_factor, p->reciprocal};
        BodyShadow shadow = bodies_shadow(&s->bodies, a, b, s->body[from], s->body[to], model);
        link.loss_db += shadow.loss_db;
        if (shadow.blocked) link.kind = NLOSV;
    }
    if (p->building_shadowing) {
        Penetration penetration = buildings_penetration(&s->buildings, a, b, p->finite_buildings);
        link.loss_db += penetration.walls * p->wall_loss + penetration.indoors * p->indoor_loss;
        if (penetration.walls > 0 || penetration.indoors > 0) link.kind = NLOSB;
    }
    return link;
}

/* An order of two antennas that does not depend on who transmits, so that rounding and ties cannot
 * make a link differ between its directions. */
static bool is_before(Position a, Position b) {
    if (a.x != b.x) return a.x < b.x;
    if (a.y != b.y) return a.y < b.y;
    return a.z < b.z;
}

Link link_between(Links *s, Scene *scene, const Parameters *p, size_t from, size_t to) {
    if (p->reciprocal) {
        bool swap = is_before(scene->antenna[to], scene->antenna[from])
            || (!is_before(scene->antenna[from], scene->antenna[to]) && to < from);
        if (swap) { size_t moved = from; from = to; to = moved; }
    }
    Link *known = &s->known[from * s->side + to];
    if (known->era != s->era) {
        *known = compute(scene, p, from, to);
        known->era = s->era;
    }
    return *known;
}
