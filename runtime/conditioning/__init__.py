"""Between a sensor and the show: a stream made into one that can be trusted.

Sensors drop joints and packets, exchange left and right, number people anew, lean, and tremble. The
steps are taken in this order, because each may rely on those before it:

1. **Time** (`timeline`): what comes twice or late is dropped; where a sender's clock jumps, the
   show's goes on. After this time only goes forward.
2. **Identity** (`identities`): who comes back under a new number keeps the old one. After this a
   performer's memory is their own.
3. **Exchanged limbs** (`faults`): left and right are put right, by where the limbs were and how
   they moved, before either side could be taken for an outlier.
4. **Outliers** (`faults`): joints that jump, or whose bones stretch, count as not seen, before
   they could enter a filter.
5. **Filling** (`replay.fill`): unseen joints are held, then eased to rest. After this nothing is
   NaN; this step alone cannot be switched off.
6. **Smoothing** (`solvers.signal.one_euro`): the One-Euro filter, on whole poses.
7. **Prediction** (`solvers.signal.prediction`): one frame ahead, by smoothed velocities.
8. **Floor** (`levelling`), **size** (`stature`), **pose held** (`held_pose`), **mirror**: the
   space of the stage. They look at what was trusted, and what is before them works in the sensor's
   own space, so that these may be switched while the show runs and nothing has to be learned anew.

Steps 1 and 2 look at every frame of the stream (`runtime.show.loop`); from 3 on the newest frame
of who drives is enough (`conditioner`). The recorder is given what came, before all of this.

`switches.Conditioning` says what is done. A live stream is given everything but prediction, mirror
and calibration by pose. A recording is only mended (2 to 5): its reader has put it in order and
level, and nobody waits for it, so clean motion capture passes unchanged.
"""
