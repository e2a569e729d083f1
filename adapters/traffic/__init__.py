"""What all sources of traffic have in common: connectors, bodies of road users, shapes."""
