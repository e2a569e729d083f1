"""What is wrong with the files of a SUMO scene, found without SUMO."""
