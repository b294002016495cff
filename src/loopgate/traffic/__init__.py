"""Traffic simulators behind one protocol: libsumo by default, traci for a window."""
