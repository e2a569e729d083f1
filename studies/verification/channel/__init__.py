"""Compares the channel FMU with golden data: `nlosim verify channel`.

Which file is checked where: `pathloss.csv` and `antenna_gain.json` in `link_budget`;
`building_shadowing.json`, `vehicle_shadowing.json` and `knife_edge_profile.json` in `shadowing`;
`nist_error_rate.csv` and `min_sinr.json` in `reception`; `nakagami_stats.csv` in `fading`;
`stack/RUN` in `stack`.
"""
