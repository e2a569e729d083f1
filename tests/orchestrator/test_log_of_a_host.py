"""What a component logs in a process of its own travels with replies, and takes no memory."""

import logging

from orchestrator.remote.host_main import RecordCollector


def test_records_beyond_a_thousand_between_two_replies_are_counted() -> None:
    """All that came before are kept whole, and the next reply has room again."""
    collector = RecordCollector()
    logger = logging.Logger("deep.inside")
    logger.addHandler(collector)
    assert collector.drain() == []
    for k in range(1003):
        logger.info("number %d", k)
    records = collector.drain()
    assert records[:1000] == [("deep.inside", logging.INFO, f"number {k}") for k in range(1000)]
    ((name, level, text),) = records[1000:]
    assert (name, level) == ("orchestrator.remote.host_main", logging.WARNING)
    assert text == "3 more log records were dropped"
    logger.error("again")
    assert collector.drain() == [("deep.inside", logging.ERROR, "again")]
    assert collector.drain() == []
