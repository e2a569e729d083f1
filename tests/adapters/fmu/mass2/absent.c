/* The functions of FMI 2.0 that nobody calls, but that a library must have; they return Error. */
#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif
#define ABSENT(name) EXPORT int fmi2##name(void) { return 3; }

ABSENT(CancelStep)
ABSENT(DeSerializeFMUstate)
ABSENT(GetBoolean)
ABSENT(GetBooleanStatus)
ABSENT(GetDirectionalDerivative)
ABSENT(GetInteger)
ABSENT(GetIntegerStatus)
ABSENT(GetStatus)
ABSENT(GetString)
ABSENT(GetStringStatus)
ABSENT(Reset)
ABSENT(SerializeFMUstate)
ABSENT(SerializedFMUstateSize)
ABSENT(SetBoolean)
ABSENT(SetDebugLogging)
ABSENT(SetInteger)
ABSENT(SetString)
