/* From one communication point to the next, by the steps or exact steps in which servobee's own simulation goes. */

/* The command that is given at a time, s, and how it goes on from there. */
typedef struct {
    double time;
    double value;
    /* Seconds until the next is given, and the change until then. */
    double lasts, change;
} Given;

/* A model between two communication points. */
typedef struct {
    Plant plant;
    State state;
    /* The length of the last integration step, and what its exact steps have in common. */
    double step;
    Stride stride;
    /* The commands that have not arrived yet, after the last that has; none but where an effect delays them. */
    Given *given;
    size_t count, room;
} Model;

/* What is `share` of the way from one input to another. */
static Input between(Input from, Input to, double share)
{
    Input input;
    input.command = from.command + share * (to.command - from.command);
    input.supply = from.supply + share * (to.supply - from.supply);
    input.tank = from.tank + share * (to.tank - from.tank);
    input.a = from.a + share * (to.a - from.a);
    input.b = from.b + share * (to.b - from.b);
    input.temperature = from.temperature + share * (to.temperature - from.temperature);
    input.time = from.time + share * (to.time - from.time);
    return input;
}

/* The command that acts when `arrived` has arrived, which the state remembers. */
static double act(Plant plant, State *state, double arrived)
{
    double acts = command(plant, *state, arrived);
    *state = remember(plant, *state, arrived);
    return acts;
}

/* The command that has arrived `after` seconds after `now`: that of `one`, which arrives late. */
static double arrived_of(const Model *model, Given one, double now, double after)
{
    double share;
    if (!INTERPOLATED)
        return one.value;
    share = (after - (delay(model->plant) + (one.time - now))) / one.lasts;
    return one.value + min(max(share, 0.0), 1.0) * one.change;
}

/* The last of the commands that has arrived at `now`. */
static size_t last_arrived(const Model *model, double now)
{
    size_t last = 0;
    while (last + 1 < model->count && (model->given[last + 1].time - now) + delay(model->plant) <= 0.0)
        last++;
    return last;
}

/* Notes a command that is given. What no command comes before any more is forgotten. Zero without memory. */
static int give(Model *model, Given given)
{
    size_t gone = model->count == 0 ? 0 : last_arrived(model, given.time);
    model->count -= gone;
    if (gone > 0)
        memmove(model->given, model->given + gone, model->count * sizeof(Given));
    if (model->count + 2 > model->room) {
        size_t room = 2 * model->room + 16;
        Given *more = realloc(model->given, room * sizeof(Given));
        if (more == NULL)
            return 0;
        model->given = more;
        model->room = room;
    }
    if (model->count == 0) {
        /* Before the first has arrived, the command has always been what that is. */
        Given always = { given.time - delay(model->plant) - 1.0, given.value, 1.0, 0.0 };
        model->given[model->count++] = always;
    }
    model->given[model->count++] = given;
    return 1;
}

/* The command that arrives at `now`, when `value` is given then. */
static double arrives(const Model *model, double now, double value)
{
    if (!DELAYED || model->count == 0 || delay(model->plant) <= 0.0)
        return value;
    return arrived_of(model, model->given[last_arrived(model, now)], now, 0.0);
}

/* The outputs at one moment, for the input of then. */
static Outputs look(const Model *model, Input input, double now)
{
    State state = model->state;
    input.command = act(model->plant, &state, arrives(model, now, input.command));
    return observe(model->plant, state, input);
}

#if EXACT_STEPS
/* One exact step, in which the command begins at `acts` and changes by `ramp` a second. */
static void one_exact_step(Model *model, Stride stride, double acts, double ramp)
{
    State *state = &model->state;
    ExactStep whole = exact_step(model->plant, stride, *state, acts, ramp);
    double left = stride.length;
    unsigned i;
    if (!(whole.more > 0.0)) {
        state->integrator = whole.integrator;
        state->spool = whole.spool;
        return;
    }
    for (i = 0; i < MOST_PARTS && left > 0.0; i++) {
        double now = acts + ramp * (stride.length - left);
        ExactStep part = turn(model->plant, stride, *state, now, ramp, left);
        state->integrator = part.integrator;
        state->spool = part.spool;
        left = part.more;
    }
}
#endif

/* Moves the model from `begin` to `end`, in seconds after `now`, while `first` is not overtaken by a later command: of `count` steps
   of `step` seconds what lies between, or by as many exact steps. `seconds` are on the way from one input to the other. */
static void run(Model *model, Given first, double now, double begin, double end, double seconds, double step, unsigned count,
                Input from, Input to)
{
    unsigned j;
#if EXACT_STEPS
    double ramp = INTERPOLATED ? (to.command - from.command) / seconds : 0.0;
    Input start = from;
    double each = DELAYED ? (end - begin) / count : step;
    if (model->stride.length != each)
        model->stride = stride_of(model->plant, each);
    for (j = 0; j < count; j++) {
        State before = model->state;
        one_exact_step(model, model->stride, from.command + ramp * (each * j), ramp);
        if (FOLLOWED) {
            Input half = INTERPOLATED ? between(from, to, (j + 0.5) / count) : from;
            Input then = INTERPOLATED ? between(from, to, (j + 1.0) / count) : from;
            model->state = follow(model->plant, before, model->state, start, half, then, each);
            start = then;
        }
    }
    (void)first, (void)now;
#else
    for (j = 0; j < count; j++) {
        /* From the end on, so that the last step has no other length by rounding. */
        double whole = step * count, left = step * (count - j);
        double since = max((begin - whole) + left, 0.0);
        double cut = min((end - whole) + left, step) - since;
        Input inputs[3];
        unsigned half;
        if (!(cut > 0.0))
            continue;
        for (half = 0; half < 3; half++) {
            double after = step * j + (since + 0.5 * half * cut);
            inputs[half] = from;
            if (INTERPOLATED) {
                double arrived;
                inputs[half] = between(from, to, DELAYED ? after / seconds : (2 * j + half) / (2.0 * count));
                arrived = DELAYED ? arrived_of(model, first, now, after) : inputs[half].command;
                inputs[half].command = act(model->plant, &model->state, arrived);
            }
        }
        model->state = advance(model->plant, model->state, inputs[0], inputs[1], inputs[2], cut);
    }
#endif
}

/* Moves the model from `now` on by `seconds`, in which the inputs are those of `from`; where they are interpolated they go
   straight to those of `to`. Zero without memory. */
static int travel(Model *model, Input from, Input to, double now, double seconds)
{
    double wanted = ceil(seconds * FASTEST_RATE / STEP_FRACTION);
    unsigned count = (unsigned)min(max(wanted, 1.0), 1e6);
    double step = seconds / count;
    Given only = { now, from.command, seconds, INTERPOLATED ? to.command - from.command : 0.0 };
    /* Rounding of the time stamps does not make another step. */
    if (fabs(step / model->step - 1.0) < JITTER)
        step = model->step;
    model->step = step;
    if (EXACT_STEPS && STEPS_OF_AN_EXACT_STEP > 1) {
        unsigned exact_steps = (count + STEPS_OF_AN_EXACT_STEP - 1) / STEPS_OF_AN_EXACT_STEP;
        step = step * count / exact_steps;
        count = exact_steps;
    }
#if DELAYED
    {
        double next = now + seconds, whole = step * count, begin = 0.0;
        size_t one;
        if (!give(model, only))
            return 0;
        /* The interval is cut where commands arrive. */
        one = last_arrived(model, now);
        while (begin < whole) {
            int last = one + 1 == model->count;
            double late = last ? 0.0 : (model->given[one + 1].time - next) + delay(model->plant);
            double end = whole - max(-late, 0.0);
            Input input = from;
            if (!INTERPOLATED)
                input.command = act(model->plant, &model->state, model->given[one].value);
            if (end > begin)
                run(model, model->given[one], now, begin, end, seconds, step, count, input, to);
            begin = end;
            if (last)
                break;
            one++;
        }
    }
#else
    {
        Input input = from;
        input.command = act(model->plant, &model->state, from.command);
        run(model, only, now, 0.0, step * count, seconds, step, count, EXACT_STEPS || !INTERPOLATED ? input : from, to);
    }
#endif
    return 1;
}
