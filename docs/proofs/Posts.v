(* Posts and vehicles that keep the chain rule by messages: no circle of full places is ever closed, and no slot is given
   twice, whatever is lost, late, out of order or said twice.

   A stay is one visit of a vehicle to a place, with a number that is used once: `stands` is the place, `wants` the next
   one, `veh` the vehicle, `src` the stay from which it was asked for. What a message says stays true, so a message that
   comes late, never or twice is a step that can be taken at any time from then on, any number of times, or never. *)
Require Export List Arith Lia Bool.
Export ListNotations.

Class roads := {
  slots : nat -> nat;
  stands : nat -> nat;
  wants : nat -> nat;
  veh : nat -> nat;
  src : nat -> nat;
  wide : forall p, 2 <= slots p;
  no_self : forall e, wants e <> stands e }.

Definition upd {A} (f : nat -> A) x v y := if Nat.eq_dec y x then v else f y.

Section Posts.
Context `{R : roads}.

(* the last slot: kept for a stay that was asked for, until its probe is answered, or for a vehicle in a place *)
Inductive keeping := Pending (f : nat) | Offered (v z : nat).

Record state := mk {
  (* what posts know: who is in line, whose rears are inside, for whom the last slot is kept and since when *)
  book : nat -> list nat; rears : nat -> list nat; kept : nat -> option keeping; since : nat -> nat;
  (* what is so: who has asked, was let in, has come, has gone on or given up, is out; and who stands in line *)
  asked : nat -> bool; granted : nat -> bool; used : nat -> bool; gone : nat -> bool; out : nat -> bool;
  queue : nat -> list nat;
  (* probes said so far: from, number, place of the asker, to, by way of, head there; and answers: to, number *)
  probe : nat -> nat -> nat -> nat -> nat -> nat -> Prop; clear : nat -> nat -> Prop; clock : nat }.

Definition held s p := match kept s p with Some _ => 1 | None => 0 end.
Definition full s p := slots p <= length (book s p) + held s p.
Definition head s p := hd_error (book s p).
Definition settled s (l : list nat) := forall e, In e l -> used s e = true \/ gone s e = true.

Definition set_kept p k s := mk (book s) (rears s) (upd (kept s) p k) (since s)
  (asked s) (granted s) (used s) (gone s) (out s) (queue s) (probe s) (clear s) (clock s).
Definition admit f s := mk (upd (book s) (stands f) (book s (stands f) ++ [f])) (rears s) (upd (kept s) (stands f) None) (since s)
  (asked s) (upd (granted s) f true) (used s) (gone s) (out s) (queue s) (probe s) (clear s) (clock s).
Definition keep f h s := mk (book s) (rears s) (upd (kept s) (stands f) (Some (Pending f))) (upd (since s) (stands f) (clock s))
  (asked s) (granted s) (used s) (gone s) (out s) (queue s)
  (fun q n a r z w => probe s q n a r z w \/
    (q = stands f /\ n = clock s /\ a = stands (src f) /\ r = wants h /\ z = stands f /\ w = h)) (clear s) (S (clock s)).
Definition say_probe q' n' a' r' z' w' s := mk (book s) (rears s) (kept s) (since s)
  (asked s) (granted s) (used s) (gone s) (out s) (queue s)
  (fun q n a r z w => probe s q n a r z w \/ (q = q' /\ n = n' /\ a = a' /\ r = r' /\ z = z' /\ w = w')) (clear s) (clock s).
Definition say_clear q' n' s := mk (book s) (rears s) (kept s) (since s)
  (asked s) (granted s) (used s) (gone s) (out s) (queue s) (probe s) (fun q n => clear s q n \/ (q = q' /\ n = n')) (clock s).
Definition hear_gone e p s := mk (upd (book s) p (remove Nat.eq_dec e (book s p))) (upd (rears s) p (e :: rears s p)) (upd (kept s) p None) (since s)
  (asked s) (granted s) (used s) (gone s) (out s) (queue s) (probe s) (clear s) (clock s).
Definition hear_out e p s := mk (book s) (upd (rears s) p (remove Nat.eq_dec e (rears s p))) (kept s) (since s)
  (asked s) (granted s) (used s) (gone s) (out s) (queue s) (probe s) (clear s) (clock s).
Definition ask f s := mk (book s) (rears s) (kept s) (since s)
  (upd (asked s) f true) (granted s) (used s) (gone s) (out s) (queue s) (probe s) (clear s) (clock s).
Definition give_up f s := mk (book s) (rears s) (kept s) (since s)
  (asked s) (granted s) (used s) (upd (gone s) f true) (upd (out s) f true) (queue s) (probe s) (clear s) (clock s).
Definition leave e s := mk (book s) (rears s) (kept s) (since s)
  (asked s) (granted s) (used s) (gone s) (upd (out s) e true) (queue s) (probe s) (clear s) (clock s).
(* who goes gives up all else that it has asked for from where it stood *)
Definition go f rest s := mk (book s) (rears s) (kept s) (since s)
  (asked s) (granted s) (upd (used s) f true)
  (fun e => gone s e || (if Nat.eq_dec e (src f) then true else false)
    || (asked s e && (if Nat.eq_dec (src e) (src f) then true else false) && (if Nat.eq_dec e f then false else true)))
  (out s) (upd (upd (queue s) (stands (src f)) rest) (stands f) (queue s (stands f) ++ [f])) (probe s) (clear s) (clock s).

Inductive step (s : state) : state -> Prop :=
(* vehicles: only the first of those who stand in a place asks and goes *)
| asks f : stands f = wants (src f) -> veh f = veh (src f) -> hd_error (queue s (stands (src f))) = Some (src f) ->
    granted s f = false -> used s f = false -> gone s f = false -> step s (ask f s)
| goes f rest : asked s f = true -> granted s f = true -> used s f = false -> gone s f = false ->
    queue s (stands (src f)) = src f :: rest -> step s (go f rest s)
| gives_up f : asked s f = true -> used s f = false -> gone s f = false -> step s (give_up f s)
| leaves e : gone s e = true -> step s (leave e s)
(* posts: one ask at a time, and the next only once who was let in last is known to have come, or to have given up *)
| enters f : asked s f = true -> granted s f = false -> kept s (stands f) = None -> settled s (book s (stands f)) ->
    length (book s (stands f)) + length (rears s (stands f)) < slots (stands f) ->
    S (length (book s (stands f))) < slots (stands f) -> step s (admit f s)
| keeps f h : asked s f = true -> granted s f = false -> kept s (stands f) = None -> settled s (book s (stands f)) ->
    length (book s (stands f)) + length (rears s (stands f)) < slots (stands f) ->
    S (length (book s (stands f))) = slots (stands f) -> head s (stands f) = Some h -> step s (keep f h s)
| passes q n a r z w h : probe s q n a r z w -> r <> q -> r <> a -> full s r -> head s r = Some h ->
    step s (say_probe q n a (wants h) r h s)
| ends q n a r z w : probe s q n a r z w -> r <> q -> (r = a \/ ~ full s r) -> step s (say_clear q n s)
| clears q f : clear s q (since s q) -> kept s q = Some (Pending f) -> step s (admit f s)
| comes_back q a z w f : probe s q (since s q) a q z w -> kept s q = Some (Pending f) -> step s (set_kept q (Some (Offered (veh w) z)) s)
| takes f v z : kept s (stands f) = Some (Offered v z) -> asked s f = true -> granted s f = false ->
    veh f = v -> stands (src f) = z -> step s (admit f s)
| drops q : step s (set_kept q None s)
| hears_gone e p : In e (book s p) -> gone s e = true -> step s (hear_gone e p s)
| hears_out e p : In e (rears s p) -> out s e = true -> step s (hear_out e p s).

(* full places in a circle: all in them are there, no head holds a grant, and each wants a place of the circle *)
Definition stuck s (C : list nat) := C <> [] /\ forall p, In p C ->
  length (book s p) = slots p /\ (forall e, In e (book s p) -> gone s e = false) /\
  exists e, head s p = Some e /\ In (wants e) C /\ forall f, In f (book s (wants e)) -> asked s f = true -> src f <> e.

(* vehicles stand in lines, nobody has asked for anything yet *)
Definition start s := (forall p, length (book s p) <= slots p /\ NoDup (book s p) /\ rears s p = [] /\ kept s p = None /\ since s p = 0
    /\ queue s p = book s p /\ forall e, In e (book s p) -> stands e = p) /\
  (forall e, (granted s e = true <-> In e (book s (stands e))) /\ used s e = granted s e /\ asked s e = false /\ gone s e = false /\ out s e = false) /\
  (forall e f, used s e = true -> used s f = true -> veh e = veh f -> e = f) /\
  (forall q n a r z w, ~ probe s q n a r z w) /\ (forall q n, ~ clear s q n) /\ clock s = 1 /\ forall C, ~ stuck s C.

Inductive reached (s0 : state) : state -> Prop :=
| at_start : start s0 -> reached s0 s0
| later s t : reached s0 s -> step s t -> reached s0 t.

Lemma first_in {A} (l : list A) e : hd_error l = Some e -> In e l.
Proof. destruct l; [discriminate|]. intros [= ->]. left. auto. Qed.
End Posts.

Ltac cases := unfold upd in *; repeat match goal with
  | |- context [Nat.eq_dec ?x ?y] => destruct (Nat.eq_dec x y); [try subst x|]
  | H : context [Nat.eq_dec ?x ?y] |- _ => destruct (Nat.eq_dec x y); [try subst x|] end.
