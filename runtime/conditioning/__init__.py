"""Conditioning: turns the raw frames of a sensor into frames that a show can rely on.

Sensors drop joints and packets, exchange left and right, number people anew, lean and tremble. The
steps come in this order, because each relies on those before it:

1. **Time** (`timeline`): late and duplicate frames are dropped; where a sender's clock jumps, the
   show's time goes on. After this step time only rises.
2. **Identity** (`identities`): a performer who comes back under a new number keeps the old one.
   After this step a performer's memory is their own.
3. **Exchanged limbs** (`faults`): left and right are put right by the limbs' last places and
   velocities, before either side could be rejected as an outlier.
4. **Outliers** (`guesses`, `faults`): joints that the tracker only guesses, that jump, or whose
   bones stretch, count as not seen, so that they enter no filter. Steps 3 and 4 believe joints that
   are exact (`exact_joints`): those of an animation, or of motion capture on a skeleton.
5. **Filling** (`replay.fill`): unseen joints keep their place, then move to rest. After this step
   no position is NaN. It is the only step without a switch. `rejoining` then moves joints that are
   seen again back without a jump.
6. **Smoothing** (`solvers.signal.one_euro`): the One-Euro filter, on whole poses.
7. **Prediction** (`solvers.signal.prediction`): one frame ahead, by smoothed velocities.
8. **Floor** (`levelling`), **size** (`stature`), **calibration pose** (`calibration_pose`),
   **mirror** (`mirror`): the transform to the stage. Steps 1 to 7 work in the sensor's own space,
   so these may be switched while the show runs and nothing has to be learned anew.

Steps 1 and 2 see every frame of the stream (`reception`); steps 3 to 8 see the newest frame of each
driving performer (`conditioner`). The recorder receives the frames before all steps.

`switches.Conditioning` holds a switch for each step. A live stream takes all steps except
prediction, mirror and calibration by pose. A recording is only mended (steps 2 to 5): its reader
has ordered and levelled it, and no delay matters, so clean motion capture passes unchanged.

Every step has `snapshot` and `restore`; `Conditioner` and `Reception` hold the states of all.
"""
