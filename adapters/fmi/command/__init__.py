"""What `nlosim fmu info|validate|run|compare` do."""
