(* Roads with capacity: places that hold some vehicles each, first in line first, and vehicles on closed loops.

   A vehicle on its loop is a spot: `place s` is where it stands there, `next s` the spot after. A configuration says who
   stands in each place, first in line first. The head of p moves to the end of the line of the place that it wants, if
   that has a slot. *)
Require Export List Arith Lia Classical.
Export ListNotations.

Class roads := {
  spot : Type;
  place : spot -> nat;
  next : spot -> spot;
  slots : nat -> nat;
  no_self : forall s, place (next s) <> place s }.

Section Model.
Context `{R : roads}.
Definition config := nat -> list spot.

(* who stands in a place stands there on its loop, and no place holds more than it can *)
Definition possible (D : config) := forall p, length (D p) <= slots p /\ forall s, In s (D p) -> place s = p.
Definition full (D : config) p := length (D p) = slots p.
Definition head (D : config) p := hd_error (D p).
Definition wants (D : config) p q := exists s, head D p = Some s /\ place (next s) = q.

Definition move p (D E : config) := exists s line,
  D p = s :: line /\ ~ full D (place (next s)) /\
  E p = line /\ E (place (next s)) = D (place (next s)) ++ [next s] /\
  forall r, r <> p -> r <> place (next s) -> E r = D r.

(* a set of full places whose heads all want places of the set; without any, no circle of full places *)
Definition jam (C : nat -> Prop) (D : config) :=
  (exists p, C p) /\ forall p, C p -> full D p /\ exists q, wants D p q /\ C q.
Definition jammed D := exists C, jam C D.

Lemma wants_one D p q r : wants D p q -> wants D p r -> q = r.
Proof. intros (s & A & <-) (t & B & <-). congruence. Qed.

Lemma wants_other D p q : possible D -> wants D p q -> q <> p.
Proof.
  intros P (s & H & <-). unfold head in H. destruct (D p) as [|t l] eqn:E; [discriminate|]. injection H as ->.
  assert (place s = p) by (apply (P p); rewrite E; left; auto). subst p. apply no_self.
Qed.

Lemma move_possible p D E : possible D -> move p D E -> possible E.
Proof.
  intros P (s & line & Dp & Room & Ep & Eq & Rest) r.
  assert (Q : place (next s) <> p).
  { intro. apply (wants_other D p p P); auto. exists s. unfold head. rewrite Dp. auto. }
  destruct (Nat.eq_dec r p) as [->|Np].
  { destruct (P p) as [L A]. rewrite Dp in *. rewrite Ep. simpl in L. split; [lia|]. intros t T. apply A. right. auto. }
  destruct (Nat.eq_dec r (place (next s))) as [->|Nq].
  { destruct (P (place (next s))) as [L A]. rewrite Eq, app_length. unfold full in Room. simpl. split; [lia|].
    intros t T. apply in_app_or in T. destruct T as [T|[<-|[]]]; auto. }
  rewrite Rest; auto.
Qed.

(* a head that wants a place with room can move *)
Theorem head_can_move D p q : possible D -> wants D p q -> ~ full D q -> exists E, move p D E.
Proof.
  intros P W Room. assert (N := wants_other D p q P W). destruct W as (s & H & <-).
  unfold head in H. destruct (D p) as [|t line] eqn:Dp; [discriminate|]. injection H as ->.
  exists (fun r => if Nat.eq_dec r p then line else if Nat.eq_dec r (place (next s)) then D r ++ [next s] else D r).
  exists s, line. repeat split; auto; intros; repeat destruct Nat.eq_dec; congruence.
Qed.

(* if nobody can move, the full places are a jam *)
Theorem somebody_can_move D p : (forall r, 0 < slots r) -> ~ jammed D -> D p <> [] ->
  exists r q, wants D r q /\ ~ full D q.
Proof.
  intros Pos N NE. apply NNPP. intro H. apply N. exists (full D).
  assert (W : forall r, D r <> [] -> exists q, wants D r q /\ full D q).
  { intros r Nr. destruct (D r) as [|s l] eqn:Dr; [contradiction|].
    assert (W : wants D r (place (next s))) by (exists s; unfold head; rewrite Dr; auto).
    exists (place (next s)). split; auto. apply NNPP. intro F. apply H. eauto. }
  split.
  - destruct (W p NE) as (q & _ & F). eauto.
  - intros r F. split; auto. apply W. intro E. unfold full in F. rewrite E in F. simpl in F.
    specialize (Pos r). lia.
Qed.

(* nobody in a jam ever moves again *)
Theorem jam_stays C D p E : jam C D -> move p D E -> ~ C p /\ jam C E /\ forall r, C r -> E r = D r.
Proof.
  intros [Some All] (s & line & Dp & Room & Ep & Eq & Rest).
  assert (Np : ~ C p).
  { intro Cp. destruct (All p Cp) as [_ (q & (t & H & W) & Cq)].
    unfold head in H. rewrite Dp in H. injection H as <-. subst q. apply Room. apply All. auto. }
  assert (Same : forall r, C r -> E r = D r).
  { intros r Cr. apply Rest; intro X; subst r; [auto|]. apply Room. apply All. auto. }
  split; [auto|split; [|auto]]. split; auto. intros r Cr. destruct (All r Cr) as [F (q & (t & H & W) & Cq)].
  split; [unfold full; rewrite Same; auto|]. exists q. split; auto. exists t. unfold head. rewrite Same; auto.
Qed.
End Model.
Print Assumptions head_can_move.
Print Assumptions somebody_can_move.
Print Assumptions jam_stays.
