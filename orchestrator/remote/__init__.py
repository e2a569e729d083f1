"""Components in other processes: the wire format, transports, and the side that hosts them."""
