"""Plants: their models, simulators, faults and scenarios. They meet the studies through `svo.plant.Plant`."""
