"""Plan the drive through a building whose cameras are to be mapped: distance against uncertainty.

Prints distance and uncertainty for two weights of the uncertainty; more weight means a longer, more accurate drive.
"""

from groma.planning.exploration import Lambda, Settings, explore, scene, try_walk

building = scene("sparse", size=16, seed=1)
for weight in (10.0, 1000.0):
    plan = explore(building, Settings(goal=Lambda(weight)))
    tried = try_walk(building, plan.walk, runs=50)  # the plan driven 50 times with drawn noise
    print(
        f"weight {weight:6.0f}: {plan.length:4.0f} m find {len(plan.cameras)} cameras, "
        f"predicted {plan.sigma:.3f} m (1 sigma), tried out {tried.map.sigma:.3f} m"
    )
