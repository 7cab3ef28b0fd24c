// Values of the uniform `schedule`; march.glsl explains them.
const int SCHEDULE_PLAIN = 0;
const int SCHEDULE_RELAXED = 1;
