/* graspforce: grasp quality and least contact forces, each with a proven bound.
 *
 * Generated from rust/c of the source by `make header`: do not edit.
 *
 * Units are m, N and N m; numbers are doubles, arrays are row-major. Contacts are numbered from 0. A contact force is
 * [n, t] (planar), [n, o, t], or [n, o, t, torsion] (soft fingers) in its contact frame; a wrench is [fx, fy, tau]
 * (planar) or [f, tau], torques about the grasp's origin.
 *
 * Every call returns a gf_status; GF_STATUS_SOLVED is 0. `message`, a buffer of `message_size` bytes, gets a text about
 * an error in UTF-8 that ends with a zero, cut off where it does not fit, or an empty text. It may be NULL.
 *
 * Structs begin with their size, which their init function sets: a program that was compiled with an older header keeps
 * working. Initialise each once, by gf_X_init(&x, sizeof x), then set what differs from the defaults.
 *
 * Memory: pointers must be NULL or aligned and point at what the comment says. Arrays are read or written during the call
 * only. Each handle is destroyed once, by its own function; NULL is ignored. Using a handle that was destroyed,
 * destroying it twice, or destroying it during a call is undefined, as for free().
 *
 * Threads: a grasp does not change, and any number of threads may use it at once. A distributor is for one thread at a
 * time; a call meanwhile from another thread returns GF_STATUS_BUSY and changes nothing.
 *
 * The control loop: gf_distributor_solve, _nearest, _set_limits, _update, _update_contacts and _forget use memory that
 * gf_distributor_create has set aside. While it suffices they neither take memory from the system nor give it back, wait
 * for no lock, make no system call and print nothing. A call that needs more takes it from the system; `reserve` sets more
 * aside. In a thread that has created no distributor, the first call that needs the interior-point solver makes one
 * system call, getrandom, which does not wait. A grasp with more contacts or edges than that of gf_distributor_create may need more; give `reserve` for it.
 *
 * No panic of Rust and no exception leaves a call. */

#ifndef GRASPFORCE_H
#define GRASPFORCE_H



#include <stddef.h>
#include <stdint.h>

/**
 * How a call ended.
 */
typedef enum {
  /**
   * The answer is there, within the tolerance asked for.
   */
  GF_STATUS_SOLVED = 0,
  /**
   * No forces inside the friction cones, or within the limits that were asked for, balance the external wrench.
   */
  GF_STATUS_INFEASIBLE = 1,
  /**
   * An argument cannot be used; the message names the argument, the contact and the value.
   */
  GF_STATUS_INVALID = 2,
  /**
   * The tolerance was not met. The bracket of a quality is valid, but wider than asked for.
   */
  GF_STATUS_NOT_CONVERGED = 3,
  /**
   * A pointer is NULL where an object or an array is needed, or is not aligned.
   */
  GF_STATUS_NULL_POINTER = 16,
  /**
   * An array has another length than the grasp needs.
   */
  GF_STATUS_WRONG_LENGTH = 17,
  /**
   * The system has no memory for the object or for a search.
   */
  GF_STATUS_OUT_OF_MEMORY = 18,
  /**
   * Another thread uses the distributor.
   */
  GF_STATUS_BUSY = 19,
  /**
   * The library is at fault. The call had no effect; please report the message.
   */
  GF_STATUS_INTERNAL_ERROR = 20,
} gf_status;

/**
 * Which measure of the contact forces is limited.
 */
typedef enum {
  /**
   * The largest normalised normal force.
   */
  GF_CRITERION_MAX = 0,
  /**
   * The sum of the normalised normal forces.
   */
  GF_CRITERION_SUM = 1,
} gf_criterion;

/**
 * What a grasp can resist.
 */
typedef enum {
  /**
   * Wrenches in all directions.
   */
  GF_CLOSURE_FORCE = 0,
  /**
   * Opposite wrenches in some directions, but not in all.
   */
  GF_CLOSURE_PARTIAL = 1,
  /**
   * No two opposite wrenches.
   */
  GF_CLOSURE_NONE = 2,
} gf_closure;

/**
 * What a distributor minimises.
 */
typedef enum {
  /**
   * The largest normalised normal force and, among its optima, their sum.
   */
  GF_OBJECTIVE_MAX = 0,
  /**
   * The sum of the normalised normal forces.
   */
  GF_OBJECTIVE_SUM = 1,
  /**
   * `sum_i weights_i |f_i - reference_i|^2 / 2`: the forces change continuously with the wrench.
   */
  GF_OBJECTIVE_SQUARES = 2,
} gf_objective;

/**
 * Least contact forces of one grasp at a time. One thread at a time uses it. Its calls take memory from
 * the system only where they need more than `reserve`.
 */
typedef struct gf_distributor gf_distributor;

/**
 * Contacts on an object with everything derived from them. It does not change, and threads may share it.
 */
typedef struct gf_grasp gf_grasp;

/**
 * Contacts of a grasp, as arrays that are read during the call only. Initialise it by `gf_contacts_init`.
 *
 * `dim` is 2 (planar, wrenches of 3 components) or 3 (spatial, wrenches of 6). Arrays are row-major, one row for each of
 * the `count` contacts. NULL is the default, where one is named.
 */
typedef struct {
  /**
   * Bytes of this struct; `gf_contacts_init` sets it.
   */
  size_t size;
  /**
   * Number of contacts.
   */
  size_t count;
  /**
   * Components of a position: 2 or 3.
   */
  size_t dim;
  /**
   * count x dim, in m.
   */
  const double *positions;
  /**
   * count x dim, into the object, of any length.
   */
  const double *normals;
  /**
   * count x dim: projected on the tangent planes they become the first tangents `o`. NULL: chosen by the library.
   */
  const double *tangents;
  /**
   * count Coulomb friction coefficients. NULL: 0.5.
   */
  const double *friction;
  /**
   * count upper bounds of the normal forces, in N. NULL: 1.
   */
  const double *max_normal_force;
  /**
   * count coefficients of torsional friction, in m; positive makes a soft finger. NULL: 0.
   */
  const double *torsion;
  /**
   * count numbers of edges of the linearised friction cones, at least 3; 0 keeps the true cone. NULL: 8. Planar
   * cones have two edges, whatever stands here.
   */
  const uint32_t *edges;
  /**
   * count numbers of rows of `extreme_forces`; 0 for a contact with a friction cone. NULL: all have friction cones.
   */
  const uint32_t *num_extreme_forces;
  /**
   * Rows `[n, t]` (planar) or `[n, o, t, torsion]` (spatial) in the contact frames, in N and N m, contact by
   * contact: the contact exerts their convex hull with zero, instead of a friction cone.
   */
  const double *extreme_forces;
} gf_contacts;

/**
 * What a grasp is measured about and with. Initialise it by `gf_grasp_options_init`.
 */
typedef struct {
  /**
   * Bytes of this struct; `gf_grasp_options_init` sets it.
   */
  size_t size;
  /**
   * Point about which torques are taken, in m; planar grasps use the first two numbers.
   */
  double origin[3];
  /**
   * Length in m that makes torques comparable with forces in the norm of quality.
   */
  double length_scale;
  /**
   * Factor of at least 1 that divides every friction coefficient.
   */
  double friction_margin;
} gf_grasp_options;

/**
 * How a distributor computes forces. Initialise it by `gf_distributor_options_init`.
 */
typedef struct {
  /**
   * Bytes of this struct; `gf_distributor_options_init` sets it.
   */
  size_t size;
  /**
   * A `gf_objective`.
   */
  int32_t objective;
  /**
   * Kibibytes that the distributor takes from the system when it is created, beside what its grasp needs: its calls
   * use them instead of the system's memory.
   */
  uint32_t reserve;
  /**
   * With `GF_OBJECTIVE_MAX`: minimise the maximum plus `weight` times the sum; at most 1e6.
   */
  double weight;
  /**
   * Largest relative gap between the objective and its proven lower bound. True cones take the longer the smaller it
   * is; 1e-6 is enough for control.
   */
  double rtol;
  /**
   * m lower bounds on the normalised normal forces, so that no finger loses contact. NULL: none.
   */
  const double *min_normal;
  /**
   * With `GF_OBJECTIVE_SQUARES`: m positive weights. NULL: 1.
   */
  const double *weights;
  /**
   * With `GF_OBJECTIVE_SQUARES`: m x k forces to stay close to, in the contact frames. NULL: zero.
   */
  const double *reference;
  /**
   * With `GF_OBJECTIVE_SQUARES`: the price S of what stays unbalanced, d x d, symmetric positive definite:
   * `residual' S residual / 2` is added, and every wrench has an answer. NULL: the forces balance the wrench.
   */
  const double *slack;
  /**
   * With `GF_OBJECTIVE_SQUARES`: 1 where normal forces keep their upper bounds, else 0.
   */
  int32_t limits;
  /**
   * Of `gf_distributor_nearest`: 1 where normal forces keep their upper bounds, else 0.
   */
  int32_t nearest_limits;
  /**
   * Of `gf_distributor_nearest`: d x d, symmetric positive definite, the norm of what stays unbalanced. NULL: that of
   * the grasp's length scale.
   */
  const double *nearest_metric;
} gf_distributor_options;

/**
 * What a solve says beside the forces. Initialise it by `gf_solution_init`.
 *
 * Planar wrenches use the first three of six numbers. Without forces all numbers are NaN, but for the `direction` of an
 * infeasible wrench.
 */
typedef struct {
  /**
   * Bytes of this struct; `gf_solution_init` sets it.
   */
  size_t size;
  /**
   * The objective.
   */
  double sigma;
  /**
   * The largest share of a contact of its limit; at most 1 within the limits.
   */
  double sigma_max;
  /**
   * The sum of the shares.
   */
  double sigma_sum;
  /**
   * Relative distance between `sigma` and the lower bound that `dual` proves.
   */
  double gap;
  /**
   * The objective changes by `-dual` with the external wrench.
   */
  double dual[6];
  /**
   * What the forces leave unbalanced: the external wrench plus that of the forces.
   */
  double residual[6];
  /**
   * The norm of the residual by `gf_distributor_nearest`; 0 by `gf_distributor_solve`.
   */
  double distance;
  /**
   * Of an infeasible wrench: a direction along which no contact can push, but the external wrench must be balanced.
   * Where stronger forces balance it: a direction along which forces within the limits do not push far enough.
   */
  double direction[6];
  /**
   * 1 where objective and tie-break alone determine the forces, else 0.
   */
  int32_t unique;
  /**
   * 1 where every normal force keeps its limit, else 0.
   */
  int32_t within_limits;
  /**
   * Simplex pivots of this solve.
   */
  uint64_t pivots;
  /**
   * 1 where another solver had to give the answer, else 0. Of nearest forces: 1 where 32 digits gave it, or where
   * nothing proves more than `gap`.
   */
  int32_t fell_back;
} gf_solution;

/**
 * How quality is asked for. Initialise it by `gf_quality_options_init`.
 */
typedef struct {
  /**
   * Bytes of this struct; `gf_quality_options_init` sets it.
   */
  size_t size;
  /**
   * A `gf_criterion`.
   */
  int32_t criterion;
  /**
   * Facets of the polytope at most; 0: 200,000.
   */
  uint32_t max_facets;
  /**
   * Relative width of the bracket, below 1; 0: 1e-9, or 1e-6 where a contact has its true cone.
   */
  double rtol;
  /**
   * d numbers: a wrench that acts all the time, such as the weight. NULL: none.
   */
  const double *external_wrench;
  /**
   * d x d, symmetric positive definite, `|w|^2 = w' M w`. NULL: the norm of the grasp's length scale.
   */
  const double *metric;
} gf_quality_options;

/**
 * The quality of a grasp, with its certificate. Initialise it by `gf_quality_init`.
 */
typedef struct {
  /**
   * Bytes of this struct; `gf_quality_init` sets it.
   */
  size_t size;
  /**
   * The largest wrench that is resisted in the worst direction, as far as it is proven: `-rho`.
   */
  double epsilon;
  /**
   * `-epsilon`: negative for force closure, positive without closure.
   */
  double rho;
  /**
   * `lower <= rho`.
   */
  double lower;
  /**
   * `rho <= upper`.
   */
  double upper;
  /**
   * The worst direction, a physical wrench of unit norm; planar grasps use the first three numbers.
   */
  double direction[6];
  /**
   * The nearest boundary wrench, `-rho * direction`.
   */
  double wrench[6];
  /**
   * A `gf_closure`: the class of the grasp itself, whatever the external wrench.
   */
  int32_t closure;
  /**
   * 1 where the bracket is as narrow as asked for, 0 elsewhere.
   */
  int32_t converged;
} gf_quality;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * Writes the defaults: no contacts, spatial, every array NULL. `size` is `sizeof(gf_contacts)`.
 */
void gf_contacts_init(gf_contacts *contacts, size_t size);

/**
 * Writes the defaults: origin zero, length scale 1 m, friction margin 1. `size` is `sizeof(gf_grasp_options)`.
 */
void gf_grasp_options_init(gf_grasp_options *options,
                           size_t size);

/**
 * Makes a distributor of a grasp, which it copies. `options` may be NULL for the defaults.
 *
 * On an error `*distributor` is NULL, and the message names the argument and the value.
 */
gf_status gf_distributor_create(const gf_grasp *grasp,
                                const gf_distributor_options *options,
                                gf_distributor **distributor,
                                char *message,
                                size_t message_size);

/**
 * Ends a distributor; nothing for NULL.
 */
void gf_distributor_destroy(gf_distributor *distributor);

/**
 * Least forces that balance an external wrench: the wrenches of the forces sum to its opposite.
 *
 * `external_wrench` has d numbers. `forces` gets m rows of k numbers in the contact frames; `num_forces` is m k. On an
 * error it keeps its numbers. `solution` may be NULL: without it a wrench like the last one takes a tenth of a
 * microsecond. For the control loop: see there.
 */
gf_status gf_distributor_solve(gf_distributor *distributor,
                               const double *external_wrench,
                               size_t wrench_dim,
                               double *forces,
                               size_t num_forces,
                               gf_solution *solution,
                               char *message,
                               size_t message_size);

/**
 * Forces whose wrench comes nearest to balance, the least among those: the forces of `gf_distributor_solve` where that
 * succeeds within the limits. `nearest_limits` and `nearest_metric` of the options say within what limits, and nearest
 * in which norm.
 *
 * Every wrench has nearest forces; `residual` holds what they leave unbalanced. Without limits the distance is proven for
 * forces up to ten times as strong as those returned. `distance` gets the norm of the residual, and `gap` of `solution`
 * what is proven of the forces: above `rtol` and 1e-9 less than asked for. Both may be NULL, the rest is as for
 * `gf_distributor_solve`. For the control loop: see there.
 */
gf_status gf_distributor_nearest(gf_distributor *distributor,
                                 const double *external_wrench,
                                 size_t wrench_dim,
                                 double *forces,
                                 size_t num_forces,
                                 double *distance,
                                 gf_solution *solution,
                                 char *message,
                                 size_t message_size);

/**
 * Goes on with other upper bounds of the normal forces, in N; zero switches a contact off. A contact fades in or out
 * where its limit changes a little at each tick. On an error nothing changes. For the control loop: see there.
 */
gf_status gf_distributor_set_limits(gf_distributor *distributor,
                                    const double *max_normal_force,
                                    size_t num_contacts,
                                    char *message,
                                    size_t message_size);

/**
 * Goes on with another grasp, which it copies: contacts have rolled or slid, or there are more or fewer of them. On an
 * error nothing changes. Limits are those of the grasp. For the control loop: see there.
 */
gf_status gf_distributor_update(gf_distributor *distributor,
                                const gf_grasp *grasp,
                                char *message,
                                size_t message_size);

/**
 * The same from arrays, so that not even the grasp takes memory from the system. `options` may be NULL for the
 * defaults. For the control loop: see there.
 */
gf_status gf_distributor_update_contacts(gf_distributor *distributor,
                                         const gf_contacts *contacts,
                                         const gf_grasp_options *options,
                                         char *message,
                                         size_t message_size);

/**
 * Forgets earlier wrenches, so that the next solve starts from nothing. The answers do not change.
 */
gf_status gf_distributor_forget(gf_distributor *distributor);

/**
 * Writes the defaults: the maximum, a gap of 1e-9, no lower bounds; nearest within the limits. `size` is
 * `sizeof(gf_distributor_options)`.
 */
void gf_distributor_options_init(gf_distributor_options *options, size_t size);

/**
 * The name of a status, such as "SOLVED"; "UNKNOWN" for other numbers.
 */
const char *gf_status_name(int32_t status);

/**
 * The version of the library, such as "0.1.0".
 */
const char *gf_version(void);

/**
 * Makes a grasp of contacts. `options` may be NULL for the defaults.
 *
 * On an error `*grasp` is NULL, and the message names the argument, the contact and the value.
 */
gf_status gf_grasp_create(const gf_contacts *contacts,
                          const gf_grasp_options *options,
                          gf_grasp **grasp,
                          char *message,
                          size_t message_size);

/**
 * Ends a grasp; nothing for NULL. Distributors of it live on.
 */
void gf_grasp_destroy(gf_grasp *grasp);

/**
 * Number m of contacts; 0 for NULL.
 */
size_t gf_grasp_num_contacts(const gf_grasp *grasp);

/**
 * Components k of a contact force: 2 `[n, t]` planar, 3 `[n, o, t]` hard fingers, 4 `[n, o, t, torsion]` soft ones.
 * 0 for NULL.
 */
size_t gf_grasp_force_dim(const gf_grasp *grasp);

/**
 * Components d of a wrench: 3 `[fx, fy, tau]` planar, 6 `[f, tau]` spatial. 0 for NULL.
 */
size_t gf_grasp_wrench_dim(const gf_grasp *grasp);

/**
 * Writes the grasp matrix, d x (m k): the forces of all contacts side by side, times it, are the wrench that the
 * contacts exert. `length` is d m k.
 */
gf_status gf_grasp_matrix(const gf_grasp *grasp,
                          double *matrix,
                          size_t length,
                          char *message,
                          size_t message_size);

/**
 * Writes the contact frames, m x dim x dim: the rows of a frame are the axes `n, t` (planar) or `n, o, t` in the world, so
 * the components of a force times these rows sum to the force in world axes. `length` is m dim dim.
 */
gf_status gf_grasp_frames(const gf_grasp *grasp,
                          double *frames,
                          size_t length,
                          char *message,
                          size_t message_size);

/**
 * Writes the defaults: the maximum, the default tolerance, no external wrench. `size` is `sizeof(gf_quality_options)`.
 */
void gf_quality_options_init(gf_quality_options *options,
                             size_t size);

/**
 * Writes NaN. `size` is `sizeof(gf_quality)`.
 */
void gf_quality_init(gf_quality *quality, size_t size);

/**
 * Measures a grasp. `options` may be NULL for the defaults.
 *
 * `GF_STATUS_NOT_CONVERGED` comes with a valid bracket that is wider than asked for. This is no call for a control
 * loop: it takes memory from the system and up to milliseconds, more where many directions are nearly as bad as the worst.
 */
gf_status gf_grasp_quality(const gf_grasp *grasp,
                           const gf_quality_options *options,
                           gf_quality *quality,
                           char *message,
                           size_t message_size);

/**
 * Writes NaN. `size` is `sizeof(gf_solution)`.
 */
void gf_solution_init(gf_solution *solution, size_t size);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* GRASPFORCE_H */
