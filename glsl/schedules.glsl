// The schedules of sphere tracing, values of the uniform `schedule`: march.glsl says what they are.
const int SCHEDULE_PLAIN = 0;
const int SCHEDULE_RELAXED = 1;
