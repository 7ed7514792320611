/* The functions of FMI 2.0 for co-simulation, around the model of physics.c and travel.c. */

#include <stdio.h>

typedef enum { INSTANTIATED, INITIALIZING, STEPPING, TERMINATED, FAILED } Phase;

typedef struct {
    fmi2CallbackFunctions callbacks;
    char *name;
    Phase phase;
    /* Inputs and parameters by their value references; how the inputs change from now until the next point, per second. */
    double values[INPUT_COUNT + PARAMETER_COUNT];
    double derivatives[INPUT_COUNT];
    /* When the simulation begins, and where it is, s. */
    double start, now;
    /* Whether the model has made its first step: only then its inputs, and so its initial state, are final. */
    int moves;
    Model model;
} Instance;

/* Tells an error; `message` has no percent sign. */
static fmi2Status refuse(const Instance *instance, const char *message)
{
    if (instance->callbacks.logger != NULL)
        instance->callbacks.logger(instance->callbacks.componentEnvironment, instance->name, fmi2Error, "logStatusError",
                                   message);
    return fmi2Error;
}

static Input input_now(const Instance *instance)
{
    return input_of(instance->values, instance->now - instance->start);
}

/* The model at its first moment, for the inputs and parameters of now. */
static Model at_first(const Instance *instance)
{
    const double *parameters = instance->values + INPUT_COUNT;
    Model model;
    memset(&model, 0, sizeof model);
    model.plant = prepare(parameters);
    model.state = initial(model.plant, input_now(instance), initial_position(parameters));
    return model;
}

static Outputs outputs_now(const Instance *instance)
{
    Model first;
    if (instance->moves)
        return look(&instance->model, input_now(instance), instance->now);
    first = at_first(instance);
    return look(&first, input_now(instance), instance->now);
}

static void set_back(Instance *instance)
{
    free(instance->model.given);
    memset(&instance->model, 0, sizeof instance->model);
    memset(instance->derivatives, 0, sizeof instance->derivatives);
    memcpy(instance->values, START, sizeof instance->values);
    instance->start = instance->now = 0.0;
    instance->moves = 0;
    instance->phase = INSTANTIATED;
}

VISIBLE const char *FMI2(GetTypesPlatform)(void)
{
    return "default";
}

VISIBLE const char *FMI2(GetVersion)(void)
{
    return "2.0";
}

VISIBLE fmi2Component FMI2(Instantiate)(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                        const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging)
{
    Instance *instance = calloc(1, sizeof *instance);
    size_t length = name == NULL ? 0 : strlen(name);
    (void)resources, (void)visible, (void)logging;
    if (instance == NULL)
        return NULL;
    if (callbacks != NULL)
        instance->callbacks = *callbacks;
    instance->name = calloc(length + 1, 1);
    if (instance->name == NULL) {
        free(instance);
        return NULL;
    }
    memcpy(instance->name, name == NULL ? "" : name, length);
    set_back(instance);
    if (type != fmi2CoSimulation)
        refuse(instance, "this FMU is for co-simulation only");
    else if (guid == NULL || strcmp(guid, GUID) != 0)
        refuse(instance, "the GUID is not that of modelDescription.xml: description and program are of different FMUs");
    else
        return instance;
    free(instance->name);
    free(instance);
    return NULL;
}

VISIBLE void FMI2(FreeInstance)(fmi2Component component)
{
    Instance *instance = component;
    if (instance == NULL)
        return;
    free(instance->model.given);
    free(instance->name);
    free(instance);
}

VISIBLE fmi2Status FMI2(SetDebugLogging)(fmi2Component component, fmi2Boolean on, size_t count,
                                         const fmi2String categories[])
{
    (void)component, (void)on, (void)count, (void)categories;
    return fmi2OK;
}

VISIBLE fmi2Status FMI2(SetupExperiment)(fmi2Component component, fmi2Boolean has_tolerance, fmi2Real tolerance,
                                         fmi2Real start, fmi2Boolean has_stop, fmi2Real stop)
{
    Instance *instance = component;
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    if (instance->phase != INSTANTIATED)
        return refuse(instance, "the experiment can be set up before initialization only");
    instance->start = instance->now = start;
    return fmi2OK;
}

VISIBLE fmi2Status FMI2(EnterInitializationMode)(fmi2Component component)
{
    Instance *instance = component;
    if (instance->phase != INSTANTIATED)
        return refuse(instance, "initialization has begun already");
    instance->phase = INITIALIZING;
    return fmi2OK;
}

VISIBLE fmi2Status FMI2(ExitInitializationMode)(fmi2Component component)
{
    Instance *instance = component;
    if (instance->phase != INITIALIZING)
        return refuse(instance, "initialization has not begun, or has ended");
    instance->phase = STEPPING;
    return fmi2OK;
}

VISIBLE fmi2Status FMI2(Terminate)(fmi2Component component)
{
    Instance *instance = component;
    instance->phase = TERMINATED;
    return fmi2OK;
}

VISIBLE fmi2Status FMI2(Reset)(fmi2Component component)
{
    set_back(component);
    return fmi2OK;
}

VISIBLE fmi2Status FMI2(GetReal)(fmi2Component component, const fmi2ValueReference references[], size_t count,
                                 fmi2Real values[])
{
    const Instance *instance = component;
    Outputs outputs = { 0.0, 0.0, 0.0 };
    int known = 0;
    size_t i;
    for (i = 0; i < count; i++) {
        fmi2ValueReference reference = references[i];
        if (reference < INPUT_COUNT + PARAMETER_COUNT) {
            values[i] = instance->values[reference];
            continue;
        }
        reference -= INPUT_COUNT + PARAMETER_COUNT;
        if (reference >= OUTPUT_COUNT)
            return refuse(instance, "there is no Real of this value reference");
        if (!known)
            outputs = outputs_now(instance);
        known = 1;
        values[i] = output_of(outputs, reference);
    }
    return fmi2OK;
}

VISIBLE fmi2Status FMI2(SetReal)(fmi2Component component, const fmi2ValueReference references[], size_t count,
                                 const fmi2Real values[])
{
    Instance *instance = component;
    size_t i;
    for (i = 0; i < count; i++) {
        fmi2ValueReference reference = references[i];
        if (reference >= INPUT_COUNT + PARAMETER_COUNT)
            return refuse(instance, "there is no input or parameter of this value reference");
        if (reference >= INPUT_COUNT) {
            if (instance->phase != INSTANTIATED && instance->phase != INITIALIZING)
                return refuse(instance, "a parameter can be set before the end of initialization only");
            /* The integration steps suit candidates inside the bounds. */
            if (!(values[i] >= LOW[reference - INPUT_COUNT] && values[i] <= HIGH[reference - INPUT_COUNT]))
                return refuse(instance, "a parameter is outside its bounds, min and max in modelDescription.xml");
        }
        instance->values[reference] = values[i];
    }
    return fmi2OK;
}

/* What the FMU has no variables of. */
static fmi2Status none_of(fmi2Component component, size_t count)
{
    return count == 0 ? fmi2OK : refuse(component, "all variables of this FMU are Real");
}

VISIBLE fmi2Status FMI2(GetInteger)(fmi2Component component, const fmi2ValueReference references[], size_t count,
                                    fmi2Integer values[])
{
    (void)references, (void)values;
    return none_of(component, count);
}

VISIBLE fmi2Status FMI2(GetBoolean)(fmi2Component component, const fmi2ValueReference references[], size_t count,
                                    fmi2Boolean values[])
{
    (void)references, (void)values;
    return none_of(component, count);
}

VISIBLE fmi2Status FMI2(GetString)(fmi2Component component, const fmi2ValueReference references[], size_t count,
                                   fmi2String values[])
{
    (void)references, (void)values;
    return none_of(component, count);
}

VISIBLE fmi2Status FMI2(SetInteger)(fmi2Component component, const fmi2ValueReference references[], size_t count,
                                    const fmi2Integer values[])
{
    (void)references, (void)values;
    return none_of(component, count);
}

VISIBLE fmi2Status FMI2(SetBoolean)(fmi2Component component, const fmi2ValueReference references[], size_t count,
                                    const fmi2Boolean values[])
{
    (void)references, (void)values;
    return none_of(component, count);
}

VISIBLE fmi2Status FMI2(SetString)(fmi2Component component, const fmi2ValueReference references[], size_t count,
                                   const fmi2String values[])
{
    (void)references, (void)values;
    return none_of(component, count);
}

/* Derivatives hold for the step that follows; after it the inputs are where they have led. */
VISIBLE fmi2Status FMI2(SetRealInputDerivatives)(fmi2Component component, const fmi2ValueReference references[],
                                                 size_t count, const fmi2Integer orders[], const fmi2Real values[])
{
    Instance *instance = component;
    size_t i;
    for (i = 0; i < count; i++) {
        if (!INTERPOLATED)
            return refuse(instance, "the inputs of this model are held between communication points");
        if (references[i] >= INPUT_COUNT || orders[i] != 1)
            return refuse(instance, "only the first derivative of an input can be set");
        instance->derivatives[references[i]] = values[i];
    }
    return fmi2OK;
}

VISIBLE fmi2Status FMI2(GetRealOutputDerivatives)(fmi2Component component, const fmi2ValueReference references[],
                                                  size_t count, const fmi2Integer orders[], fmi2Real values[])
{
    (void)references, (void)orders, (void)values;
    return count == 0 ? fmi2OK : refuse(component, "this FMU gives no derivatives of outputs");
}

VISIBLE fmi2Status FMI2(DoStep)(fmi2Component component, fmi2Real now, fmi2Real seconds, fmi2Boolean final)
{
    Instance *instance = component;
    Input from, to;
    Outputs outputs;
    size_t i;
    (void)final;
    if (instance->phase != STEPPING)
        return refuse(instance, "a step needs an initialized FMU that has not terminated or failed");
    if (!(seconds > 0.0 && seconds < HUGE_VAL && fabs(now) < HUGE_VAL))
        return refuse(instance, "a step lasts a positive and finite time");
    instance->now = now;
    if (!instance->moves) {
        instance->model = at_first(instance);
        instance->moves = 1;
    }
    from = input_now(instance);
    for (i = 0; i < INPUT_COUNT; i++) {
        instance->values[i] += instance->derivatives[i] * seconds;
        instance->derivatives[i] = 0.0;
    }
    instance->now = now + seconds;
    to = input_of(instance->values, from.time + seconds);
    instance->phase = FAILED;
    if (!travel(&instance->model, from, to, now, seconds))
        return refuse(instance, "there is not enough memory for the commands that are under way");
    outputs = outputs_now(instance);
    if (diverged(instance->model.state) || !(fabs(outputs.spool) < STATE_LIMIT && fabs(outputs.flow) < STATE_LIMIT &&
                                             fabs(outputs.position) < STATE_LIMIT))
        return refuse(instance, "the simulation diverges: check the parameters and the units of the inputs");
    instance->phase = STEPPING;
    return fmi2OK;
}

VISIBLE fmi2Status FMI2(CancelStep)(fmi2Component component)
{
    return refuse(component, "a step ends before its call does");
}

VISIBLE fmi2Status FMI2(GetStatus)(fmi2Component component, const fmi2StatusKind kind, fmi2Status *value)
{
    (void)component, (void)kind, (void)value;
    return fmi2Discard;
}

VISIBLE fmi2Status FMI2(GetRealStatus)(fmi2Component component, const fmi2StatusKind kind, fmi2Real *value)
{
    const Instance *instance = component;
    if (kind != fmi2LastSuccessfulTime)
        return fmi2Discard;
    *value = instance->now;
    return fmi2OK;
}

VISIBLE fmi2Status FMI2(GetIntegerStatus)(fmi2Component component, const fmi2StatusKind kind, fmi2Integer *value)
{
    (void)component, (void)kind, (void)value;
    return fmi2Discard;
}

VISIBLE fmi2Status FMI2(GetBooleanStatus)(fmi2Component component, const fmi2StatusKind kind, fmi2Boolean *value)
{
    const Instance *instance = component;
    if (kind != fmi2Terminated)
        return fmi2Discard;
    *value = instance->phase == TERMINATED;
    return fmi2OK;
}

VISIBLE fmi2Status FMI2(GetStringStatus)(fmi2Component component, const fmi2StatusKind kind, fmi2String *value)
{
    (void)component, (void)kind, (void)value;
    return fmi2Discard;
}

/* Copies all of an instance but what it is called and who hears of it. Zero without memory. */
static int copy(Instance *to, const Instance *from)
{
    Given *given = malloc((from->model.count + 1) * sizeof(Given));
    Instance kept = *to;
    if (given == NULL)
        return 0;
    if (from->model.count > 0)
        memcpy(given, from->model.given, from->model.count * sizeof(Given));
    free(to->model.given);
    *to = *from;
    to->model.given = given;
    to->model.room = from->model.count + 1;
    to->name = kept.name;
    to->callbacks = kept.callbacks;
    return 1;
}

VISIBLE fmi2Status FMI2(GetFMUstate)(fmi2Component component, fmi2FMUstate *state)
{
    int fresh = *state == NULL;
    if (fresh)
        *state = calloc(1, sizeof(Instance));
    if (*state != NULL && copy(*state, component))
        return fmi2OK;
    if (fresh) {
        free(*state);
        *state = NULL;
    }
    return refuse(component, "there is not enough memory for a copy of the state");
}

VISIBLE fmi2Status FMI2(SetFMUstate)(fmi2Component component, fmi2FMUstate state)
{
    if (state != NULL && copy(component, state))
        return fmi2OK;
    return refuse(component, "there is no state, or not enough memory for it");
}

VISIBLE fmi2Status FMI2(FreeFMUstate)(fmi2Component component, fmi2FMUstate *state)
{
    (void)component;
    if (*state != NULL)
        free(((Instance *)*state)->model.given);
    free(*state);
    *state = NULL;
    return fmi2OK;
}

VISIBLE fmi2Status FMI2(SerializedFMUstateSize)(fmi2Component component, fmi2FMUstate state, size_t *size)
{
    (void)state, (void)size;
    return refuse(component, "a state cannot be serialized");
}

VISIBLE fmi2Status FMI2(SerializeFMUstate)(fmi2Component component, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    (void)state, (void)bytes, (void)size;
    return refuse(component, "a state cannot be serialized");
}

VISIBLE fmi2Status FMI2(DeSerializeFMUstate)(fmi2Component component, const fmi2Byte bytes[], size_t size,
                                             fmi2FMUstate *state)
{
    (void)bytes, (void)size, (void)state;
    return refuse(component, "a state cannot be serialized");
}

VISIBLE fmi2Status FMI2(GetDirectionalDerivative)(fmi2Component component, const fmi2ValueReference unknowns[],
                                                  size_t unknown_count, const fmi2ValueReference known[],
                                                  size_t known_count, const fmi2Real changes[], fmi2Real values[])
{
    (void)unknowns, (void)unknown_count, (void)known, (void)known_count, (void)changes, (void)values;
    return refuse(component, "this FMU gives no directional derivatives");
}
