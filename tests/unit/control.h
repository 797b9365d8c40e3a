/* SPDX-License-Identifier: MIT */
/* control.h - what the tests of mechanics, feedback and the guard share: the parameters under test, and differences. Include after
   small.h. */
#ifndef CONTROL_H
#define CONTROL_H

#define CHECK_OK(call) CHECK((call) == ROLN_OK)

static roln_real theta_k[MAXP]; /* parameters of the model under test */

ROLN_FN instance of_model(int k)
{
    return trained(models[k], scale_of(k), theta_k);
}

/* A true autoencoder (the constraint holds) and a random network. */
ROLN_FN void valid(int k, uint64_t *s)
{
    parameters(k, s, theta_k);
    CHECK_OK(roln_ae_init(&models[k]->md->ae, theta_k, s, ROOM(init)));
}

#ifdef ROLN_DOUBLE
/* Derivative of what v holds at shifts of h: error h^4 f''''' / 30. */
#define SLOPE(v, i, h) ((8 * ((v)[0][i] - (v)[1][i]) - ((v)[2][i] - (v)[3][i])) / (12 * (h)))
static const double shift[4] = {1, -1, 2, -2};
#endif

#endif
