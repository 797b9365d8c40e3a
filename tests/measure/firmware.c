/* firmware.c - what a model adds to firmware that controls and predicts, and with TRAIN learns: sizes.sh takes flash and RAM of
   this object file, and the stack of its functions. */

#define ROLN_FLASH __attribute__((section(".rodata.weights")))
#include "firmware.h"
#define WEIGHTS_(m) STRING(m##_weights.h)
#define WEIGHTS(m) WEIGHTS_(m)
#include WEIGHTS(MODEL)

#define DT 0.001f /* s, from tick to tick */

__attribute__((section(".rodata.measure"))) const M(params) *const weights = &M(weights);
struct control control;

#ifdef TRAIN
struct learner learner;
#define PARAMS (&learner.p)
#else
#define PARAMS (&M(weights))
#endif

roln_status tick(void)
{
    static const roln_limits limits = {0.1f, 1e9f, 1e9f, 5, 1e9f, 1e9f}; /* every check is made */
    struct control *c = &control;
    return M(tick)(PARAMS, &limits, DT, &c->x, &c->ref, c->kp, c->kd, &c->s, &c->guard, &c->work) != 0 ? ROLN_E_RANGE : ROLN_OK;
}

roln_status ahead(void)
{
    return M(step)(PARAMS, &control.s, control.guard.tau, DT, &control.work);
}

#ifdef TRAIN
roln_status train(void)
{
    static const roln_loss acceleration = ROLN_ACC_WEIGHTS, ode = ROLN_ODE_WEIGHTS;
    static const roln_opt rates = ROLN_OPT(0.001f, 0.001f);
    struct learner *l = &learner;
    const roln_batch sample = {1, 0, 1, NULL, l->q, l->qd, l->qdd, NULL};
    const roln_batch window = {1, HORIZON, 1, NULL, l->q, l->qd, NULL, NULL};
    roln_status st;
    memset(&l->gradient, 0, sizeof l->gradient);
    st = M(grad_acc)(&l->p, &acceleration, &sample, &l->gradient, &l->work);
    if (st == ROLN_OK) st = M(grad)(&l->p, &ode, &window, l->p.dt, &l->gradient, &l->work);
    if (st == ROLN_OK) st = M(update)(&l->p, &rates, &l->optimiser, &l->gradient, &l->work);
    return st;
}
#endif
