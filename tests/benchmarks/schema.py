"""JSON Schema of what `nlosim bench --json` prints."""

NUMBER_OR_NULL = {"type": ["number", "null"]}
ROW = {
    "type": "object",
    "required": ["case", "ours", "low", "high", "peer", "peer_name", "ratio", "unit", "details"],
    "properties": {
        "case": {"type": "string"},
        "ours": {"type": "number"},
        "low": {"type": "number"},
        "high": {"type": "number"},
        "peer": NUMBER_OR_NULL,
        "peer_name": {"type": ["string", "null"]},
        "ratio": NUMBER_OR_NULL,
        "unit": {"type": "string"},
        "is_higher_better": {"type": "boolean"},
        "details": {"type": "object", "additionalProperties": {"type": "number"}},
    },
}
BENCHMARK = {
    "type": "object",
    "required": ["name", "description", "peer", "repetitions", "complete", "rows"],
    "properties": {"rows": {"type": "array", "items": ROW}, "complete": {"type": "boolean"}},
}
ENVIRONMENT = {
    "required": ["machine", "versions", "commit", "created"],
    "properties": {
        "machine": {"required": ["cpu", "cpus", "memory_gib", "load_average", "platform"]},
        "versions": {"required": ["nlosim", "python", "numpy"]},
    },
}
ONE = {"allOf": [BENCHMARK, ENVIRONMENT]}
SEVERAL = {
    "allOf": [
        {"required": ["benchmarks"], "properties": {"benchmarks": {"items": BENCHMARK}}},
        ENVIRONMENT,
    ]
}
